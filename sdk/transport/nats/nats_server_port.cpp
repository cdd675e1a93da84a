#include "sdk/transport/nats/nats_server_port.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "sdk/wire/envelope.hpp"
#include "sdk/wire/frame_bundle.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::transport {

using nats::Ask;
using nats::Beat;
using nats::participant;

namespace {

constexpr std::size_t kMaxViewerMessage = 64U << 10U;
constexpr std::size_t kMaxWaiting = 4096;  // messages of a kind that wait to be taken
constexpr std::size_t kScheduledLogBytes = 4U << 20U;
constexpr std::size_t kMaxRivals = 16;

}  // namespace

NatsServerPort::NatsServerPort(NatsPortOptions options, std::unique_ptr<NatsBus> bus)
    : options_(std::move(options)),
      bus_(std::move(bus)),
      answers_(options_.sender),
      beats_(options_.sender),
      unpacker_(kMaxViewerMessage),
      writes_(options_.sender),
      followers_(options_.most_clients),
      scheduled_(kScheduledLogBytes) {
  static_cast<void>(bus_->subscribe(nats::subject(options_.session, "from.>"), group()));
  static_cast<void>(bus_->subscribe(nats::subject(options_.session, "hello")));
  static_cast<void>(bus_->subscribe(nats::subject(options_.session, "beat")));
}

NatsServerPort::~NatsServerPort() { beat(true); }

ParticipantId NatsServerPort::self() const { return participant("", options_.sender); }

Result<void> NatsServerPort::publish(const std::string& subject, std::span<const std::byte> message,
                                     nats::Packer& packer) {
  std::uint64_t packets = 0, bytes = 0;
  Result<void> sent;
  for (const Bytes& packet : packer.pack(message, bus_->most_bytes())) {
    sent = bus_->publish(subject, packet);
    if (!sent) break;
    ++packets;
    bytes += packet.size();
  }
  const std::lock_guard lock(mutex_);
  counts_.published += packets;
  counts_.published_bytes += bytes;
  if (!sent) ++counts_.unpublished;
  return sent;
}

template <class M>
Result<void> NatsServerPort::send(const std::string& subject, const M& message) {
  Bytes envelope;
  write_envelope(message, envelope);
  return publish(subject, envelope, writes_);
}

// What the NATS server does not take now is in the log, and asked for.
template <class M>
Result<void> NatsServerPort::log_and_send(const std::string& subject, nats::SentLog& log,
                                          std::uint64_t number, const M& message) {
  auto envelope = std::make_shared<Bytes>();
  write_envelope(message, *envelope);
  {
    const std::lock_guard lock(mutex_);
    log.add(number, envelope, options_.clock());
  }
  static_cast<void>(publish(subject, *envelope, writes_));
  return {};
}

Result<void> NatsServerPort::open_streams(std::uint32_t count) {
  if (count == 0 || count > kMaxStreams) return fail(ErrorCode::kInvalidArgument, "1 to 8 streams");
  const std::lock_guard lock(mutex_);
  for (std::uint32_t id = 0; id < count; ++id) {
    if (!deltas_[id]) deltas_[id].emplace(options_.log_bytes / count);
  }
  return {};
}

Result<void> NatsServerPort::write(const SessionMessage& message) {
  auto envelope = std::make_shared<Bytes>();
  write_envelope(message, *envelope);
  {
    const std::lock_guard lock(mutex_);
    epoch_ = message.epoch;
    period_ns_ = period_ns_of(message.frame_rate_hz);
    announcement_ = nats::fnv1a({reinterpret_cast<const char*>(envelope->data()), envelope->size()});
    session_ = std::move(envelope);
    for (const StreamMessage& stream : message.streams) ids_[stream.id.id % kMaxStreams] = stream.id;
  }
  bus_->wake();  // whoever takes tells it with the next beat
  return {};
}

// Followers ask for missing frames one by one, so each frame travels by itself.
Result<void> NatsServerPort::write(const DeltaMessage& message) {
  if (message.earlier > 0) {
    const std::vector<FrameRun> runs = read_frames(message);
    if (runs.empty()) return fail(ErrorCode::kInvalidArgument, "a delta that breaks the format");
    DeltaMessage alone = message;
    alone.earlier = 0;
    for (const FrameRun& run : runs) {
      alone.hash = run.hash;
      alone.payload.assign(run.payload.begin(), run.payload.end());
      for (alone.frame = run.last - run.before; alone.frame <= run.last; ++alone.frame) {
        alone.server_time_ns = made_ns(message, alone.frame, period_ns_);
        if (auto written = write(alone); !written) return written;
      }
    }
    return {};
  }
  if (message.stream.id >= kMaxStreams || !deltas_[message.stream.id])
    return fail(ErrorCode::kInvalidArgument, "a stream that is not open");
  return log_and_send(nats::delta_subject(options_.session, message.stream.id), *deltas_[message.stream.id],
                      message.frame, message);
}

Result<void> NatsServerPort::write(const ScheduledInputMessage& message) {
  return log_and_send(nats::subject(options_.session, "inputs"), scheduled_, message.number, message);
}

std::string NatsServerPort::to(ClientId client) const {
  const std::lock_guard lock(mutex_);
  const std::string site = followers_.site_of(client);
  return site.empty() ? site : nats::to_subject(options_.session, site, client);
}

Result<void> NatsServerPort::write(ClientId client, const SnapshotMessage& message) {
  const std::string subject = to(client);
  if (subject.empty()) return fail(ErrorCode::kInvalidArgument, "a client that is not open");
  return send(subject, message);
}

Result<void> NatsServerPort::write(const ReplyMessage& message) {
  const std::string subject = to(message.client);
  return subject.empty() ? Result<void>() : send(subject, message);
}

Result<void> NatsServerPort::write(const ServerStatusMessage& message) {
  return send(nats::subject(options_.session, "status"), message);
}

Result<void> NatsServerPort::open_client(ClientId /*client*/) { return {}; }
void NatsServerPort::close_client(ClientId /*client*/) {}

void NatsServerPort::pump() {
  now_ns_ = options_.clock();
  arrivals_.clear();
  bus_->take(arrivals_);
  for (const NatsArrival& arrival : arrivals_) accept(arrival);
  bool changed = false;
  {
    const std::lock_guard lock(mutex_);
    changed = session_ != nullptr && announced_ != announcement_;
    announced_ = announcement_;
  }
  if (changed || now_ns_ - beat_ns_ >= kBeatNs) beat(false);
  if (now_ns_ - swept_ns_ >= kSecond) forget_silent();
}

void NatsServerPort::beat(bool leaving) {
  beat_ns_ = now_ns_;
  Beat beat;
  {
    const std::lock_guard lock(mutex_);
    if (!session_) return;
    beat.epoch = epoch_;
    beat.announcement = announcement_;
    beat.leaving = leaving;
    beat.inputs = scheduled_.range();
    for (std::size_t id = 0; id < deltas_.size(); ++id) {
      if (deltas_[id]) beat.streams.push_back({ids_[id], deltas_[id]->range()});
    }
  }
  Bytes message;
  nats::write(beat, message);
  static_cast<void>(publish(nats::subject(options_.session, "beat"), message, beats_));
}

void NatsServerPort::accept(const NatsArrival& arrival) {
  const auto malformed = [this] {
    const std::lock_guard lock(mutex_);
    ++counts_.malformed;
  };
  const auto unpacked = unpacker_.take(arrival.subject, arrival.bytes);
  if (!unpacked) return;
  const auto kind = std::to_integer<std::uint8_t>(unpacked->message[0]);
  const auto sender = nats::read_from_subject(options_.session, arrival.subject);
  if (kind == nats::kHelloKind) {
    const auto hello = nats::read_hello(unpacked->message);
    return hello ? accept(*hello) : malformed();
  }
  if (!sender) {
    if (kind != nats::kBeatKind || unpacked->sender == options_.sender) return;
    const auto beat = nats::read_beat(unpacked->message);
    if (!beat) return malformed();
    if (beat->leaving) {
      rivals_.erase(unpacked->sender);
    } else if (rivals_.size() < kMaxRivals || rivals_.contains(unpacked->sender)) {
      rivals_[unpacked->sender] = {beat->epoch, now_ns_};
    }
    return;
  }
  std::optional<nats::Followers::Heard> heard;
  {
    const std::lock_guard lock(mutex_);
    if (kind == nats::kByeKind) return followers_.left(sender->site, unpacked->sender, sender->client);
    heard = followers_.heard(sender->site, unpacked->sender, sender->client, now_ns_);
    if (!heard) ++counts_.turned_away;
  }
  if (!heard) return;
  if (kind == nats::kAskKind) {
    const auto ask = nats::read_ask(unpacked->message);
    if (!ask) return malformed();
    return answer(*ask, *heard, nats::to_subject(options_.session, sender->site, sender->client));
  }
  auto message = read_viewer_envelope(unpacked->message);
  if (!message) return malformed();
  if (auto* const report = std::get_if<ClientStatusMessage>(&*message)) {
    if (reports_.size() >= kMaxWaiting) return;
    reports_.push_back(std::move(*report));
    static_cast<void>(publish(nats::subject(options_.session, "clients"), unpacked->message, answers_));
  } else if (auto* const ack = std::get_if<AckMessage>(&*message)) {
    if (ack->client != sender->client) return malformed();
    if (acks_.size() < kMaxWaiting) acks_.push_back({std::move(*ack), heard->from});
  } else if (auto* const input = std::get_if<InputMessage>(&*message)) {
    if (input->client != sender->client) return malformed();
    if (inputs_.size() < kMaxWaiting) inputs_.push_back({std::move(*input), heard->from});
  }
}

// Whoever can send Hello may say any name in it. Only the site itself hears its proof, so a name without one
// costs nothing but an answer.
void NatsServerPort::accept(const nats::Hello& hello) {
  const std::uint64_t proof = nats::site_proof(options_.secret, hello.site);
  if (hello.proof == proof) {
    const auto known = sites_.find(hello.site);
    if (known != sites_.end()) {
      known->second = now_ns_;
    } else if (sites_.size() < kMaxSites &&
               bus_->subscribe(nats::site_subject(options_.session, hello.site), group())) {
      sites_.emplace(hello.site, now_ns_);
    }
  } else if (proofs_.spend(1, now_ns_)) {
    Bytes message;
    nats::write_proof(proof, message);
    static_cast<void>(publish(nats::proof_subject(options_.session, hello.site), message, answers_));
  }
}

void NatsServerPort::answer(const Ask& ask, const nats::Followers::Heard& asker, const std::string& to) {
  std::vector<nats::SentLog::Message> messages;
  const std::array budgets{&asker.process->bytes, asker.site_bytes, &all_bytes_};
  bool allowed = asker.process->asks.spend(1, now_ns_);
  double left = kAllBurst;
  for (nats::Allowance* const budget : budgets) {
    allowed = budget->spend(0, now_ns_) && allowed;
    left = std::min(left, budget->left);
  }
  {
    const std::lock_guard lock(mutex_);
    ++counts_.asks;
    if (ask.epoch != epoch_) allowed = false;
    const auto most = allowed ? static_cast<std::size_t>(std::max(1.0, left)) : 0;
    if (!allowed) {
      ++counts_.asks_refused;
    } else if (ask.what == Ask::For::kSession) {
      if (session_) messages.push_back(session_);
    } else if (ask.what == Ask::For::kInputs) {
      scheduled_.list(ask.first, ask.count, most, messages);
    } else if (deltas_[ask.stream.id] && ids_[ask.stream.id] == ask.stream) {
      deltas_[ask.stream.id]->list(ask.first, ask.count, most, messages);
    }
  }
  std::size_t bytes = 0;
  for (const auto& message : messages) {
    bytes += message->size();
    static_cast<void>(publish(to, *message, answers_));
  }
  for (nats::Allowance* const budget : budgets) budget->spend(static_cast<double>(bytes), now_ns_);
  const std::lock_guard lock(mutex_);
  counts_.repeated += messages.size();
  counts_.repeated_bytes += bytes;
}

void NatsServerPort::forget_silent() {
  swept_ns_ = now_ns_;
  std::erase_if(sites_, [this](const auto& entry) {
    if (now_ns_ - entry.second <= kSiteSilentNs) return false;
    bus_->unsubscribe(nats::site_subject(options_.session, entry.first));
    return true;
  });
  std::erase_if(rivals_, [this](const auto& entry) {
    return now_ns_ - entry.second.heard_ns > NatsClientPort::kSilentNs;
  });
  const std::lock_guard lock(mutex_);
  followers_.forget_silent(now_ns_);
}

void NatsServerPort::take_sessions(std::vector<Received<SessionMessage>>& out) {
  pump();
  for (const auto& [sender, rival] : rivals_) {
    if (now_ns_ - rival.heard_ns > NatsClientPort::kSilentNs) continue;
    SessionMessage session;
    session.session = options_.session;
    session.epoch = rival.epoch;
    out.push_back({std::move(session), participant("", sender)});
  }
}

void NatsServerPort::take(std::vector<Received<InputMessage>>& out) {
  pump();
  std::move(inputs_.begin(), inputs_.end(), std::back_inserter(out));
  inputs_.clear();
}

void NatsServerPort::take(std::vector<Received<AckMessage>>& out) {
  pump();
  std::move(acks_.begin(), acks_.end(), std::back_inserter(out));
  acks_.clear();
}

void NatsServerPort::take(std::vector<ClientStatusMessage>& out) {
  std::move(reports_.begin(), reports_.end(), std::back_inserter(out));
  reports_.clear();
}

bool NatsServerPort::joined(const ParticipantId& participant, ClientId /*client*/, std::uint32_t stream) {
  return stream < kMaxStreams && deltas_[stream] && alive(participant);
}

bool NatsServerPort::alive(const ParticipantId& participant) {
  const std::lock_guard lock(mutex_);
  return followers_.alive(participant, options_.clock());
}

bool NatsServerPort::ended(const ParticipantId& participant) {
  const std::lock_guard lock(mutex_);
  return !followers_.knows(participant);
}

std::uint64_t NatsServerPort::dropped() const {
  const std::lock_guard lock(mutex_);
  return counts_.malformed + unpacker_.dropped() + bus_->overrun();
}

std::optional<PublishedCounts> NatsServerPort::counts() const {
  const std::lock_guard lock(mutex_);
  PublishedCounts counts = counts_;
  counts.followers = followers_.processes();
  return counts;
}

}  // namespace tandem::transport
