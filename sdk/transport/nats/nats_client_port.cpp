#include "sdk/transport/nats/nats_client_port.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <utility>
#include <variant>

namespace tandem::transport {

using nats::Ask;
using nats::Beat;

namespace {

// How many inputs before the first delta are asked for: it may count some that a snapshot does not hold.
constexpr std::uint32_t kEarlierInputs = 64;
constexpr std::size_t kMaxQueued = 8192;             // messages of a kind
constexpr std::size_t kMaxQueuedBytes = 64U << 20U;  // of snapshots

}  // namespace

NatsClientPort::NatsClientPort(NatsPortOptions options, std::unique_ptr<NatsBus> bus)
    : options_(std::move(options)),
      bus_(std::move(bus)),
      from_(nats::from_subject(options_.session, options_.site, options_.client)),
      to_(nats::to_subject(options_.session, options_.site, options_.client)),
      packer_(options_.sender) {
  static_cast<void>(bus_->subscribe(to_));
  static_cast<void>(bus_->subscribe(nats::proof_subject(options_.session, options_.site)));
  static_cast<void>(bus_->subscribe(nats::subject(options_.session, "beat")));
}

// A relay that starts anew goes on with the epoch, so the epoch is who serves it.
ParticipantId NatsClientPort::server() const {
  ParticipantId id;
  std::memcpy(id.bytes.data(), &epoch_, sizeof epoch_);
  std::memcpy(id.bytes.data() + sizeof epoch_, &again_, sizeof again_);
  return id;
}

void NatsClientPort::pass_over_session(PassOver until) {
  if (until != PassOver::kUntilAnnouncedAnew || !have_ || again_ns_) return;
  again_ns_ = now_ns_ + again_after_ns_;
  again_after_ns_ = std::min(2 * again_after_ns_, kMaxAgainNs);
}

NatsClientPort::~NatsClientPort() {
  const std::byte bye{nats::kByeKind};
  static_cast<void>(publish(from_, {&bye, 1}));
}

Result<void> NatsClientPort::publish(const std::string& subject, std::span<const std::byte> message) {
  for (const Bytes& packet : packer_.pack(message, bus_->most_bytes())) {
    if (auto sent = bus_->publish(subject, packet); !sent) return sent;
  }
  return {};
}

template <class M>
Result<void> NatsClientPort::send(const M& message) {
  envelope_.clear();
  write_envelope(message, envelope_);
  return publish(from_, envelope_);
}

bool NatsClientPort::ask(const Ask& ask) {
  Bytes message;
  nats::write(ask, message);
  ++counts_.asked;
  return publish(from_, message).has_value();
}

void NatsClientPort::pump() {
  now_ns_ = options_.clock();
  arrivals_.clear();
  bus_->take(arrivals_);
  for (const NatsArrival& arrival : arrivals_) accept(arrival);
  if (again_ns_ && now_ns_ >= *again_ns_) {
    again_ns_.reset();
    ++again_;
    have_.reset();
    session_timer_ = {};
  }
  ask_for_missing();
}

void NatsClientPort::accept(const NatsArrival& arrival) {
  const auto unpacked = unpacker_.take(arrival.subject, arrival.bytes);
  if (!unpacked) return;
  if (unpacked->message[0] == std::byte{nats::kBeatKind}) {
    auto beat = nats::read_beat(unpacked->message);
    if (!beat) {
      ++counts_.malformed;
      return;
    }
    return accept(*beat, unpacked->sender);
  }
  if (unpacked->message[0] == std::byte{nats::kProofKind}) {
    const auto proof = nats::read_proof(unpacked->message);
    if (!proof || unpacked->sender != relay_ || *proof == proof_) return;
    proof_ = *proof;
    say_hello();
    return ask_again();
  }
  auto message = read_gateway_envelope(unpacked->message, widest());
  if (!message) {
    ++counts_.malformed;
    return;
  }
  accept(std::move(*message), arrival.subject == to_);
}

// Of two relays the one that is followed goes on, until it is silent or leaves.
void NatsClientPort::accept(const Beat& beat, std::uint32_t sender) {
  const bool followed = epoch_ != 0 && !left_ && now_ns_ - beat_ns_ < kSilentNs;
  if (followed && (beat.epoch != epoch_ || (sender != relay_ && beat.leaving))) return;
  if (beat.leaving) {
    left_ = left_ || sender == relay_;
    return;
  }
  if (beat.epoch != epoch_) {
    close_streams();
    epoch_ = beat.epoch;
    again_ns_.reset();
    again_after_ns_ = kAgainNs;
    have_.reset();
    session_.reset();
    session_timer_ = {};
  }
  if (!followed || relay_ != sender) ask_again();
  if (relay_ != sender) {
    relay_ = sender;
    say_hello();
  }
  left_ = false;
  beat_ns_ = now_ns_;
  announcement_ = beat.announcement;
  inputs_range_ = beat.inputs;
  frames_ = beat.streams;
  if (beat.inputs.newest >= beat.inputs.oldest) inputs_repair_.skip_to(beat.inputs.oldest);
  for (const Beat::OfStream& of : beat.streams) {
    Stream* const stream = find(of.stream);
    if (stream == nullptr || of.frames.newest < of.frames.oldest) continue;
    if (stream->deltas.begun() && of.frames.oldest > stream->deltas.next())
      counts_.given_up += of.frames.oldest - stream->deltas.next();
    stream->deltas.skip_to(of.frames.oldest);
    stream->deltas.exists(of.frames.newest);
  }
}

NatsClientPort::Stream* NatsClientPort::find(const StreamId& id) {
  const auto found = streams_.find(id.id);
  return found != streams_.end() && found->second.id == id ? &found->second : nullptr;
}

Limits NatsClientPort::widest() const {
  if (streams_.empty()) return {};
  Limits limits{.max_delta_bytes = 0, .max_snapshot_bytes = 0};
  for (const auto& [id, stream] : streams_) {
    limits.max_delta_bytes = std::max(limits.max_delta_bytes, stream.limits.max_delta_bytes);
    limits.max_snapshot_bytes = std::max(limits.max_snapshot_bytes, stream.limits.max_snapshot_bytes);
  }
  return limits;
}

void NatsClientPort::accept_delta(DeltaMessage&& delta, bool repeated) {
  Stream* const stream = find(delta.stream);
  if (delta.epoch != epoch_ || stream == nullptr || delta.payload.size() > stream->limits.max_delta_bytes)
    return;
  if (!inputs_repair_.begun()) {
    inputs_repair_.begin(delta.last_input);
    if (delta.last_input > 0) {
      const std::uint32_t count =
          static_cast<std::uint32_t>(std::min<std::uint64_t>(delta.last_input, kEarlierInputs));
      ask({.epoch = epoch_,
           .what = Ask::For::kInputs,
           .first = delta.last_input - count + 1,
           .count = count});
    }
  }
  stream->deltas.take(std::move(delta), repeated);
}

void NatsClientPort::accept(GatewayMessage&& message, bool repeated) {
  const auto room = [](const auto& queue) { return queue.size() < kMaxQueued; };
  std::visit(
      [&](auto& content) {
        using M = std::remove_cvref_t<decltype(content)>;
        if constexpr (std::is_same_v<M, SessionMessage>) {
          if (!repeated || content.epoch != epoch_ || content.session != options_.session) return;
          have_ = announcement_;
          session_ = std::move(content);
        } else if constexpr (std::is_same_v<M, DeltaMessage>) {
          if (repeated) ++counts_.repaired;
          accept_delta(std::move(content), repeated);
        } else if constexpr (std::is_same_v<M, ScheduledInputMessage>) {
          if (content.epoch != epoch_ || streams_.empty() || !room(inputs_)) return;
          if (!inputs_repair_.came(content.number)) return;
          if (repeated) ++counts_.repaired;
          inputs_.push_back(std::move(content));
        } else if constexpr (std::is_same_v<M, SnapshotMessage>) {
          Stream* const stream = find(content.stream);
          if (content.epoch != epoch_ || stream == nullptr || !stream->snapshots) return;
          const std::size_t size = content.bytes.size() + sizeof content;
          if (queued_bytes_ + size > kMaxQueuedBytes) return;
          queued_bytes_ += size;
          snapshots_.push_back(std::move(content));
        } else if constexpr (std::is_same_v<M, ReplyMessage>) {
          if (content.client == options_.client && room(replies_)) replies_.push_back(std::move(content));
        } else if constexpr (std::is_same_v<M, ServerStatusMessage>) {
          if (content.epoch == epoch_ && statuses_.size() < kMaxStreams)
            statuses_.push_back(std::move(content));
        }
      },
      message);
}

// Requests that were sent meanwhile reached nobody.
void NatsClientPort::ask_again() {
  for (auto& [id, stream] : streams_) stream.timer = {};
  inputs_timer_ = session_timer_ = {};
}

// Behind a leaf node, a relay hears the sites that it knows by Hello only.
void NatsClientPort::say_hello() {
  hello_ns_ = now_ns_;
  Bytes message;
  nats::write(nats::Hello{options_.site, proof_}, message);
  static_cast<void>(publish(nats::subject(options_.session, "hello"), message));
}

void NatsClientPort::ask_for_missing() {
  if (epoch_ == 0 || left_ || !bus_->connected()) return;
  if (now_ns_ - hello_ns_ >= kHelloNs) say_hello();
  if (have_ != announcement_ && session_timer_.due(announcement_, 1, true, now_ns_)) {
    say_hello();
    ask({.epoch = epoch_, .what = Ask::For::kSession});
  }
  std::uint64_t wanted_input = 0;
  for (auto& [id, stream] : streams_) {
    if (const auto wanted = stream.deltas.wanted_input()) wanted_input = std::max(wanted_input, *wanted);
    const std::uint32_t missing = stream.deltas.missing();
    if (missing == 0) {
      stream.timer.rest();
    } else if (stream.timer.due(stream.deltas.next(), missing, stream.deltas.overtaken(), now_ns_)) {
      ask({.epoch = epoch_,
           .what = Ask::For::kDeltas,
           .stream = stream.id,
           .first = stream.deltas.next(),
           .count = missing});
    }
  }
  const std::uint32_t lost = inputs_repair_.missing(wanted_input);
  const std::uint32_t missing = inputs_repair_.missing(std::max(wanted_input, inputs_range_.newest));
  if (missing == 0) {
    inputs_timer_.rest();
  } else if (inputs_timer_.due(inputs_repair_.next(), missing, lost > 0, now_ns_)) {
    ask({.epoch = epoch_, .what = Ask::For::kInputs, .first = inputs_repair_.next(), .count = missing});
  }
}

void NatsClientPort::take_sessions(std::vector<Received<SessionMessage>>& out) {
  pump();
  if (session_) out.push_back({*std::exchange(session_, std::nullopt), server()});
}

bool NatsClientPort::server_alive() {
  pump();
  return have_.has_value() && !left_ && now_ns_ - beat_ns_ < kSilentNs;
}

std::string NatsClientPort::trouble() {
  if (unpacker_.foreign_version() != 0 && epoch_ == 0) {
    return "the relay of session '" + options_.session + "' speaks version " +
           std::to_string(unpacker_.foreign_version()) + " of the relay protocol, and this program version " +
           std::to_string(nats::kRelayVersion);
  }
  return bus_->trouble();
}

Result<void> NatsClientPort::open_stream(const SessionMessage& session, const StreamMessage& stream,
                                         ClientId /*client*/) {
  if (session.epoch != epoch_) return fail(ErrorCode::kTransport, "the relay is in another epoch by now");
  for (const std::string& subject :
       {nats::subject(options_.session, "inputs"), nats::subject(options_.session, "status"),
        nats::delta_subject(options_.session, stream.id.id)}) {
    if (auto subscribed = bus_->subscribe(subject); !subscribed) return subscribed;
  }
  Stream& opened = streams_[stream.id.id];
  if (opened.limits.max_delta_bytes != stream.max_delta_bytes || !(opened.id == stream.id)) opened = {};
  opened.id = stream.id;
  opened.limits = {.max_delta_bytes = stream.max_delta_bytes,
                   .max_snapshot_bytes = stream.max_snapshot_bytes};
  resume(opened);
  return {};
}

// If all that came since then can still be asked for.
void NatsClientPort::resume(Stream& stream) {
  if (!options_.kept || stream.deltas.begun()) return;
  const auto found = std::find_if(frames_.begin(), frames_.end(),
                                  [&](const Beat::OfStream& of) { return of.stream == stream.id; });
  if (found == frames_.end()) return;
  auto kept = options_.kept(epoch_, stream.id);
  if (!kept || kept->frame + 1 < found->frames.oldest || kept->frame > found->frames.newest) return;
  stream.deltas.begin(kept->frame + 1);
  stream.deltas.exists(found->frames.newest);
  inputs_repair_.begin(0);  // as far back as the relay has them
  if (inputs_range_.newest >= inputs_range_.oldest) inputs_repair_.skip_to(inputs_range_.oldest);
  stream.kept = std::move(kept);
}

Result<void> NatsClientPort::write(const AckMessage& message) {
  if (message.phase == Phase::kJoining) {
    Stream* const stream = find(message.stream);
    // The question is repeated until the first of the missed deltas is there. A fresh snapshot would leave
    // out what those behind this client need.
    if (stream != nullptr && stream->answered == message.join_attempt) return {};
    if (stream != nullptr && stream->kept && stream->snapshots) {
      ++counts_.resumed;
      stream->answered = message.join_attempt;
      snapshots_.push_back(*std::exchange(stream->kept, std::nullopt));
      bus_->wake();
      return {};
    }
  }
  return send(message);
}

void NatsClientPort::close_stream(std::uint32_t stream) {
  if (streams_.erase(stream) == 0) return;
  bus_->unsubscribe(nats::delta_subject(options_.session, stream));
  if (streams_.empty()) close_streams();
}

void NatsClientPort::close_streams() {
  for (const auto& [id, stream] : streams_) bus_->unsubscribe(nats::delta_subject(options_.session, id));
  streams_.clear();
  bus_->unsubscribe(nats::subject(options_.session, "inputs"));
  bus_->unsubscribe(nats::subject(options_.session, "status"));
  inputs_repair_ = {};
  inputs_timer_ = {};
  inputs_.clear();
  snapshots_.clear();
  queued_bytes_ = 0;
  replies_.clear();
  statuses_.clear();
}

Result<void> NatsClientPort::open_snapshots(std::uint32_t stream) {
  const auto found = streams_.find(stream);
  if (found == streams_.end()) return fail(ErrorCode::kTransport, "a stream that is not open");
  found->second.snapshots = true;
  return {};
}

void NatsClientPort::close_snapshots(std::uint32_t stream) {
  const auto found = streams_.find(stream);
  if (found != streams_.end()) found->second.snapshots = false;
}

namespace {

template <class M>
void move_all(std::vector<M>& queue, const ParticipantId& from, std::vector<Received<M>>& out) {
  for (M& message : queue) out.push_back({std::move(message), from});
  queue.clear();
}

}  // namespace

void NatsClientPort::take(std::vector<Received<DeltaMessage>>& out) {
  pump();
  std::vector<DeltaMessage> deltas;
  for (auto& [id, stream] : streams_) stream.deltas.release(inputs_repair_, deltas);
  move_all(deltas, server(), out);
}
void NatsClientPort::take(std::vector<Received<ScheduledInputMessage>>& out) {
  move_all(inputs_, server(), out);
}
void NatsClientPort::take(std::vector<Received<SnapshotMessage>>& out) {
  move_all(snapshots_, server(), out);
  queued_bytes_ = 0;
}
void NatsClientPort::take(std::vector<Received<ReplyMessage>>& out) { move_all(replies_, server(), out); }
void NatsClientPort::take(std::vector<Received<ServerStatusMessage>>& out) {
  move_all(statuses_, server(), out);
}

std::optional<FollowedCounts> NatsClientPort::counts() const {
  FollowedCounts counts = counts_;
  counts.malformed = dropped();
  return counts;
}

std::uint64_t NatsClientPort::dropped() const {
  return counts_.malformed + unpacker_.dropped() + bus_->overrun();
}

}  // namespace tandem::transport
