#include "services/tool/doctor/nats_doctor.hpp"

#include <chrono>
#include <thread>
#include <utility>

#include "sdk/wire/client_id.hpp"
#include "sdk/wire/clock.hpp"

namespace tandem::doctor {
namespace {

using transport::steady_ns;
using transport::nats::subject;

constexpr std::int64_t kListenNs = 2 * kSecond;
constexpr int kQuestions = 5;

/// Tries things one after the other: what the server refuses, it says after its answer to a question.
class Trial {
 public:
  explicit Trial(transport::NatsBus& bus) : bus_(bus) {}

  void subscribe(const std::string& to, std::vector<std::string>& refused) {
    const std::uint64_t before = bus_.refusals();
    static_cast<void>(bus_.subscribe(to));
    judge("listen on " + to, before, refused);
    bus_.unsubscribe(to);
  }
  /// Publishes nothing, which no reader takes for a packet.
  void publish(const std::string& to, std::vector<std::string>& refused) {
    const std::uint64_t before = bus_.refusals();
    static_cast<void>(bus_.publish(to, {}));
    judge("publish on " + to, before, refused);
  }

 private:
  void judge(std::string what, std::uint64_t before, std::vector<std::string>& refused) {
    static_cast<void>(bus_.round_trip_ns());
    // libnats tells of refusals in another thread.
    for (int i = 0; i < 10 && bus_.refusals() == before; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    if (bus_.refusals() != before) refused.push_back(std::move(what));
  }
  transport::NatsBus& bus_;
};

void try_permissions(transport::NatsBus& bus, NatsFacts& facts) {
  Trial trial(bus);
  const transport::ClientId client = transport::random_client_id();
  const std::string session = facts.session.empty() ? "doctor-" + std::to_string(client) : facts.session;
  for (const char* const what : {"beat", "delta.0", "inputs", "status"})
    trial.subscribe(subject(session, what), facts.refused_to_follow);
  trial.subscribe(transport::nats::to_subject(session, facts.site, client), facts.refused_to_follow);
  trial.publish(transport::nats::from_subject(session, facts.site, client), facts.refused_to_follow);
  trial.publish(subject(session, "hello"), facts.refused_to_follow);
  for (const char* const what : {"beat", "delta.0", "inputs", "status", "clients"})
    trial.publish(subject(session, what), facts.refused_to_publish);
  trial.publish(transport::nats::to_subject(session, facts.site, client), facts.refused_to_publish);
  for (const char* const what : {"from.>", "hello"})
    trial.subscribe(subject(session, what), facts.refused_to_publish);
}

}  // namespace

NatsFacts nats_facts(const transport::NatsOptions& options, const std::string& site,
                     const std::string& session) {
  NatsFacts facts;
  facts.url = transport::without_password(options.url);
  facts.site = site;
  facts.session = session;
  transport::NatsOptions once = options;
  once.once = true;
  auto tried = transport::make_nats_bus(once);
  auto heard = transport::make_nats_bus(once);
  if (!tried || !heard) {
    const Error& error = (tried ? heard : tried).error();
    (error.code == ErrorCode::kTransport ? facts.trouble : facts.fault) = error.message;
    return facts;
  }
  facts.reached = true;
  facts.most_bytes = (*tried)->most_bytes();
  for (int i = 0; i < kQuestions; ++i) {
    if (const auto ns = (*tried)->round_trip_ns()) facts.round_trips_ns.push_back(*ns);
  }
  try_permissions(**tried, facts);
  transport::NatsMonitor monitor({.session = {},
                                  .site = site,
                                  .client = transport::random_client_id(),
                                  .sender = static_cast<std::uint32_t>(transport::random_client_id()),
                                  .clock = steady_ns},
                                 transport::wall_ns, session, std::move(*heard));
  std::vector<transport::Received<transport::SessionMessage>> announced;
  for (const std::int64_t until_ns = steady_ns() + kListenNs; steady_ns() < until_ns;) {
    monitor.wait(std::chrono::milliseconds(50));
    announced.clear();
    monitor.list_sessions(announced);
  }
  facts.sessions = monitor.heard();
  facts.foreign_version = monitor.foreign_version();
  return facts;
}

}  // namespace tandem::doctor
