#include "sdk/transport/nats/nats_server_port.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "sdk/transport/envelope.hpp"

namespace tandem::transport {

using nats::Ask;
using nats::Beat;

namespace {

constexpr std::size_t kMostViewerMessage = 64U << 10U;
constexpr std::size_t kMostQueued = 4096;  // messages of a kind that wait to be taken
constexpr std::size_t kScheduledLogBytes = 4U << 20U;
constexpr std::size_t kMostRivals = 16;

std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return hash;
}

// The NATS server vouches for the site, the site for its processes and their clients. Client 0: the process.
ParticipantId participant(const std::string& site, std::uint32_t sender, ClientId client = 0) {
  ParticipantId id;
  const std::uint64_t of_site = fnv1a(site);
  for (std::size_t i = 0; i < 8; ++i) id.bytes[i] = static_cast<std::uint8_t>(of_site >> (8U * i));
  for (std::size_t i = 0; i < 4; ++i) id.bytes[8 + i] = static_cast<std::uint8_t>(sender >> (8U * i));
  for (std::size_t i = 0; i < 8; ++i) id.bytes[12 + i % 4] ^= static_cast<std::uint8_t>(client >> (8U * i));
  return id;
}

ParticipantId process_of(ParticipantId id) {
  std::fill(id.bytes.begin() + 12, id.bytes.end(), std::uint8_t{0});
  return id;
}

}  // namespace

bool NatsServerPort::Allowance::spend(double amount, std::int64_t now_ns) {
  if (at_ns != INT64_MIN) left = std::min(burst, left + rate * 1e-9 * static_cast<double>(now_ns - at_ns));
  at_ns = now_ns;
  if (left <= 0) return false;
  left -= amount;
  return true;
}

NatsServerPort::NatsServerPort(NatsPortOptions options, std::unique_ptr<NatsBus> bus)
    : options_(std::move(options)),
      bus_(std::move(bus)),
      answers_(options_.sender),
      beats_(options_.sender),
      unpacker_(kMostViewerMessage),
      writes_(options_.sender),
      scheduled_(kScheduledLogBytes) {
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
    announcement_ = fnv1a({reinterpret_cast<const char*>(envelope->data()), envelope->size()});
    session_ = std::move(envelope);
    for (const StreamMessage& stream : message.streams) ids_[stream.id.id % kMaxStreams] = stream.id;
  }
  bus_->wake();  // whoever takes tells it with the next beat
  return {};
}

Result<void> NatsServerPort::write(const DeltaMessage& message) {
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
  const auto found = clients_.find(client);
  return found == clients_.end() ? std::string()
                                 : nats::to_subject(options_.session, found->second.site, client);
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
    const auto site = nats::read_hello(unpacked->message);
    if (!site) return malformed();
    if (sites_.contains(*site) || sites_.size() >= kMostSites) return;
    if (bus_->subscribe(nats::site_subject(options_.session, *site))) sites_.insert(*site);
    return;
  }
  if (!sender) {
    if (kind != nats::kBeatKind || unpacked->sender == options_.sender) return;
    const auto beat = nats::read_beat(unpacked->message);
    if (!beat) return malformed();
    if (beat->leaving) {
      rivals_.erase(unpacked->sender);
    } else if (rivals_.size() < kMostRivals || rivals_.contains(unpacked->sender)) {
      rivals_[unpacked->sender] = {beat->epoch, now_ns_};
    }
    return;
  }
  const ParticipantId process = participant(sender->site, unpacked->sender);
  const ParticipantId from = participant(sender->site, unpacked->sender, sender->client);
  if (kind == nats::kByeKind) return forget(from);
  const bool known = followers_.contains(process);
  if (!known && followers_.size() >= kMostFollowers) return malformed();
  if (!heard_.contains(from) && heard_.size() >= kMostFollowers) return malformed();
  heard_[from] = now_ns_;
  Follower& follower = followers_[process];
  follower.site = sender->site;
  follower.heard_ns = now_ns_;
  {
    const std::lock_guard lock(mutex_);
    follower_count_ = followers_.size();
    const auto client = clients_.find(sender->client);
    if (client == clients_.end()) {
      if (clients_.size() >= kMostFollowers) return;
      clients_[sender->client] = {sender->site, from, now_ns_};
    } else if (client->second.site == sender->site) {
      client->second.heard_ns = now_ns_;
      client->second.from = from;
    }  // else it is another site's: that one is answered, and the account tells the other
  }
  if (kind == nats::kAskKind) {
    const auto ask = nats::read_ask(unpacked->message);
    if (!ask) return malformed();
    return answer(*ask, follower, nats::to_subject(options_.session, sender->site, sender->client));
  }
  auto message = read_viewer_envelope(unpacked->message);
  if (!message) return malformed();
  if (auto* const report = std::get_if<ClientStatusMessage>(&*message)) {
    if (reports_.size() >= kMostQueued) return;
    reports_.push_back(std::move(*report));
    static_cast<void>(publish(nats::subject(options_.session, "clients"), unpacked->message, answers_));
  } else if (auto* const ack = std::get_if<AckMessage>(&*message)) {
    if (ack->client != sender->client) return malformed();
    if (acks_.size() < kMostQueued) acks_.push_back({std::move(*ack), from});
  } else if (auto* const input = std::get_if<InputMessage>(&*message)) {
    if (input->client != sender->client) return malformed();
    if (inputs_.size() < kMostQueued) inputs_.push_back({std::move(*input), from});
  }
}

void NatsServerPort::answer(const Ask& ask, Follower& follower, const std::string& to) {
  std::vector<nats::SentLog::Message> messages;
  bool allowed =
      follower.asks.spend(1, now_ns_) && follower.bytes.spend(0, now_ns_) && all_bytes_.spend(0, now_ns_);
  {
    const std::lock_guard lock(mutex_);
    ++counts_.asks;
    if (ask.epoch != epoch_) allowed = false;
    const auto most =
        allowed ? static_cast<std::size_t>(std::max(1.0, std::min(follower.bytes.left, all_bytes_.left))) : 0;
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
  follower.bytes.spend(static_cast<double>(bytes), now_ns_);
  all_bytes_.spend(static_cast<double>(bytes), now_ns_);
  const std::lock_guard lock(mutex_);
  counts_.repeated += messages.size();
  counts_.repeated_bytes += bytes;
}

// A process has a client for each stream that it follows, and is there as long as one of them is.
void NatsServerPort::forget(const ParticipantId& client) {
  heard_.erase(client);
  const ParticipantId process = process_of(client);
  const auto other = heard_.lower_bound(process);
  if (other != heard_.end() && process_of(other->first) == process) return;
  followers_.erase(process);
  const std::lock_guard lock(mutex_);
  follower_count_ = followers_.size();
}

void NatsServerPort::forget_silent() {
  swept_ns_ = now_ns_;
  std::erase_if(followers_,
                [this](const auto& entry) { return now_ns_ - entry.second.heard_ns > kForgottenNs; });
  std::erase_if(heard_, [this](const auto& entry) { return now_ns_ - entry.second > kForgottenNs; });
  std::erase_if(rivals_, [this](const auto& entry) {
    return now_ns_ - entry.second.heard_ns > NatsClientPort::kSilentNs;
  });
  const std::lock_guard lock(mutex_);
  follower_count_ = followers_.size();
  std::erase_if(clients_,
                [this](const auto& entry) { return now_ns_ - entry.second.heard_ns > kForgottenNs; });
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
  const auto found = heard_.find(participant);
  return found != heard_.end() && options_.clock() - found->second < kSilentNs;
}

bool NatsServerPort::ended(const ParticipantId& participant) { return !heard_.contains(participant); }

std::uint64_t NatsServerPort::dropped() const {
  const std::lock_guard lock(mutex_);
  return counts_.malformed + unpacker_.dropped() + bus_->overrun();
}

NatsServerPort::Counts NatsServerPort::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::size_t NatsServerPort::followers() const {
  const std::lock_guard lock(mutex_);
  return follower_count_;
}

}  // namespace tandem::transport
