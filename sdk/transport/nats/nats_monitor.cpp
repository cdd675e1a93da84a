#include "sdk/transport/nats/nats_monitor.hpp"

#include <algorithm>
#include <cstring>
#include <utility>
#include <variant>

#include "sdk/wire/envelope.hpp"

namespace tandem::transport {
namespace {

constexpr std::size_t kMaxKnown = 4096;  // messages of a kind
constexpr std::int64_t kAskNs = kSecond;
constexpr std::int64_t kListensNs = kSecond / 4;  // until a relay that was told the proof hears this site

ParticipantId relay_id(std::uint32_t sender) {
  ParticipantId id;
  std::memcpy(id.bytes.data(), &sender, sizeof sender);
  return id;
}

/// The session's name in `subject`, and what follows it; empty if it is no subject of ours.
std::pair<std::string, std::string> parts(const std::string& subject) {
  const std::size_t first = subject.find('.');
  const std::size_t second = first == std::string::npos ? first : subject.find('.', first + 1);
  if (second == std::string::npos) return {};
  return {subject.substr(first + 1, second - first - 1), subject.substr(second + 1)};
}

}  // namespace

NatsMonitor::NatsMonitor(NatsPortOptions options, std::function<std::int64_t()> wall,
                         const std::string& session, std::unique_ptr<NatsBus> bus)
    : options_(std::move(options)), wall_(std::move(wall)), bus_(std::move(bus)), packer_(options_.sender) {
  const std::string which = session.empty() ? "*" : session;
  for (const char* const what : {"beat", "status", "clients"})
    static_cast<void>(bus_->subscribe(nats::subject(which, what)));
  static_cast<void>(bus_->subscribe(nats::to_subject(which, options_.site, options_.client)));
  static_cast<void>(bus_->subscribe(nats::proof_subject(which, options_.site)));
}

void NatsMonitor::publish(const std::string& subject, std::span<const std::byte> message) {
  for (const Bytes& packet : packer_.pack(message, bus_->most_bytes()))
    static_cast<void>(bus_->publish(subject, packet));
}

void NatsMonitor::pump() {
  now_ns_ = options_.clock();
  arrivals_.clear();
  bus_->take(arrivals_);
  for (const NatsArrival& arrival : arrivals_) accept(arrival);
  for (auto& [name, heard] : heard_) {
    std::erase_if(heard.relays, [this](const auto& entry) {
      return now_ns_ - entry.second.heard_ns > NatsClientPort::kSilentNs;
    });
  }
  std::erase_if(heard_, [](const auto& entry) { return entry.second.relays.empty(); });
  ask_for_announcements();
}

void NatsMonitor::accept(const NatsArrival& arrival) {
  const auto unpacked = unpacker_.take(arrival.subject, arrival.bytes);
  const auto [session, what] = parts(arrival.subject);
  if (!unpacked || session.empty()) return;
  if (what == "beat") return accept_beat(session, unpacked->message, unpacked->sender);
  if (unpacked->message[0] == std::byte{nats::kProofKind}) return accept_proof(session, unpacked->message);
  const auto known = heard_.find(session);
  if (what == "clients") {
    auto message = read_viewer_envelope(unpacked->message);
    auto* const report = message ? std::get_if<ClientStatusMessage>(&*message) : nullptr;
    if (report != nullptr) keep(std::move(*report), unpacked->sender, clients_);
    return;
  }
  auto message = read_gateway_envelope(unpacked->message);
  if (!message) return;
  if (auto* const status = std::get_if<ServerStatusMessage>(&*message)) {
    keep(std::move(*status), unpacked->sender, servers_);
  } else if (auto* const announced = std::get_if<SessionMessage>(&*message)) {
    if (known == heard_.end()) return;
    known->second.session = std::move(*announced);
    known->second.have = known->second.announcement;
  }
}

template <class M>
void NatsMonitor::keep(M&& message, std::uint32_t sender, std::vector<Stamped<M>>& known) {
  if (known.size() >= kMaxKnown) return;
  Stamped<M>& stamped = known.emplace_back();
  stamped.message = std::move(message);
  stamped.from = relay_id(sender);
  stamped.written_ns = wall_();
}

void NatsMonitor::accept_beat(const std::string& session, std::span<const std::byte> message,
                              std::uint32_t sender) {
  const auto beat = nats::read_beat(message);
  if (!beat || (!heard_.contains(session) && heard_.size() >= kMaxSessions)) return;
  Heard& heard = heard_[session];
  if (beat->leaving) {
    heard.relays.erase(sender);
    return;
  }
  if (!heard.relays.contains(sender) && heard.relays.size() >= kMaxRelays) return;
  heard.relays[sender] = {beat->epoch, now_ns_};
  heard.announcement = beat->announcement;
}

void NatsMonitor::accept_proof(const std::string& session, std::span<const std::byte> message) {
  const auto proof = nats::read_proof(message);
  const auto known = heard_.find(session);
  if (!proof || known == heard_.end() || known->second.proof == *proof) return;
  known->second.proof = *proof;
  say_hello(session, known->second);
  known->second.asked_ns = now_ns_ - kAskNs + kListensNs;
}

void NatsMonitor::say_hello(const std::string& session, const Heard& heard) {
  Bytes message;
  nats::write(nats::Hello{options_.site, heard.proof}, message);
  publish(nats::subject(session, "hello"), message);
}

// Relays answer sites that made themselves known.
void NatsMonitor::ask_for_announcements() {
  for (auto& [name, heard] : heard_) {
    if (heard.have == heard.announcement || now_ns_ - heard.asked_ns < kAskNs) continue;
    heard.asked_ns = now_ns_;
    say_hello(name, heard);
    Bytes message;
    nats::write({.epoch = heard.relays.begin()->second.epoch, .what = nats::Ask::For::kSession}, message);
    publish(nats::from_subject(name, options_.site, options_.client), message);
  }
}

void NatsMonitor::list_sessions(std::vector<Received<SessionMessage>>& out) {
  pump();
  for (const auto& [name, heard] : heard_) {
    if (heard.have) out.push_back({heard.session, relay_id(heard.relays.begin()->first)});
  }
}

void NatsMonitor::take(std::vector<Stamped<ServerStatusMessage>>& out) {
  pump();
  std::move(servers_.begin(), servers_.end(), std::back_inserter(out));
  servers_.clear();
}

void NatsMonitor::take(std::vector<Stamped<ClientStatusMessage>>& out) {
  pump();
  std::move(clients_.begin(), clients_.end(), std::back_inserter(out));
  clients_.clear();
}

Result<void> NatsMonitor::write(const CommandMessage& /*message*/) {
  return fail(ErrorCode::kUnsupported, "commands do not travel over NATS");
}

}  // namespace tandem::transport
