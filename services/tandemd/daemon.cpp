#include "services/tandemd/daemon.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/network/reach.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/port.hpp"
#include "sdk/wire/units.hpp"
#include "services/engines/scenes/scene.hpp"
#include "services/engines/scenes/script.hpp"
#include "services/host/host.hpp"
#include "services/host/keeping/keeping.hpp"
#include "services/host/outgoing/publisher.hpp"
#include "services/host/planning/plan.hpp"
#include "services/host/waiting.hpp"
#include "services/program/json/json.hpp"
#include "services/program/logging/log.hpp"
#include "services/tandemd/configuration/rehearsal.hpp"
#include "services/tandemd/console.hpp"
#include "services/tandemd/hash_log.hpp"
#include "services/tandemd/metrics.hpp"
#include "services/tandemd/restarts.hpp"
#include "services/tandemd/served_world.hpp"
#include "services/tandemd/service.hpp"
#include "services/tandemd/stand_by.hpp"

namespace tandem::daemon {
namespace {

using transport::steady_ns;
using transport::wall_ns;

/// How the server ends: its log and its engine hear the same.
class Verdict {
 public:
  int fail(const Error& error, int exit_code) {
    spdlog::error(error.message);
    why_ = error.message;
    return exit_code;
  }
  /// Of the last failure.
  [[nodiscard]] const std::string& why() const { return why_; }

 private:
  std::string why_ = "the server failed: its log says why";
};

/// Runs the scene's script: sends each input in time for its frame.
class ScriptSender {
 public:
  /// `scene` may be empty if there is no script.
  ScriptSender(const std::optional<scenes::Scene>& scene, const DaemonOptions& options)
      : lead_(options.lead) {
    if (scene && options.scripted) script_.emplace(*scene, options.seed, options.users);
  }

  /// Leaves out what a checkpoint of that frame holds already: it was sent before the frame was made.
  void skip_to(Frame frame) {
    if (script_) static_cast<void>(script_->until(frame + lead_));
  }

  void send_due(host::Host& host) {
    if (!script_) return;
    for (const scenes::ScriptedInput& scripted : script_->until(host.frame() + 1 + lead_)) {
      const auto sent = host.inject(scripted.input);
      if (!sent) spdlog::warn("scripted input for frame {}: {}", scripted.frame, sent.error().message);
    }
  }

 private:
  std::optional<scenes::Script> script_;
  std::uint32_t lead_;
};

Result<std::unique_ptr<transport::ServerPort>> open_port(const host::HostConfig& config,
                                                         const DaemonOptions& options, Metrics& metrics,
                                                         const std::atomic<bool>& stop) {
  const auto largest = host::largest_delta_bytes(config.streams);
  if (!largest) return tl::unexpected(largest.error());
  transport::DdsOptions dds;
  dds.domain = options.domain;
  dds.profile = options.profile;
  dds.session = options.session;
  dds.secure = options.secure;
  dds.delta_depth = transport::delta_depth(config.frame_rate_hz, config.window_ceiling, *largest);
  dds.stop = &stop;
  if (options.metrics) dds.repeated_bytes = &metrics.repeated_bytes();
  return transport::make_dds_server_port(dds);
}

/// Logs failed writes: the first one at once, then their number every 10 s.
class FailureLog {
 public:
  explicit FailureLog(const host::Publisher& publisher) : publisher_(&publisher) {}

  void show(std::int64_t now_ns) {
    const std::uint64_t failures = publisher_->failures();
    if (failures == told_ || now_ns < next_ns_) return;
    spdlog::warn("{} writes failed, the last: {}", failures - told_, publisher_->last_failure());
    told_ = failures;
    next_ns_ = now_ns + 10 * kSecond;
  }

 private:
  const host::Publisher* publisher_;
  std::uint64_t told_ = 0;
  std::int64_t next_ns_ = 0;
};

void log_line(const std::string& line, bool warning) {
  spdlog::log(warning ? spdlog::level::warn : spdlog::level::info, line);
}

/// Adds the frame that was made last: once for each stream, whatever offers of it are played.
void log_frame(const host::Host& host, HashLog& hashes) {
  host::StreamSet logged;
  for (const host::DeltaReport& delta : host.report().deltas) {
    const std::uint32_t stream = host.session().streams[delta.stream].carries;
    if (!logged[stream]) hashes.add(stream, host.report().frame, delta.hash);
    logged.set(stream);
  }
}

/// Makes the frame whose step is under way, so that a last checkpoint can be written; but does not wait long.
void finish_frame(host::Host& host, transport::ServerPort& port, HashLog& hashes) {
  const std::int64_t until_ns = steady_ns() + kSecond;
  host.rest_after_frame();
  while (host.frame_under_way() && !host.error() && steady_ns() < until_ns) {
    host::wait_for_work(host, port, std::chrono::milliseconds{10});
    if (!host.poll(steady_ns(), wall_ns())) continue;
    log_frame(host, hashes);
  }
  host.tell_collected_frames();
}

enum class Ending : std::uint8_t { kDone, kRefused, kNobodyCame, kCannotWrite, kHandedOver, kMoved };

/// Whether only a new DDS participant would be on the network; looks once a second.
bool network_moved() { return transport::dds_server_network() == transport::NetworkState::kMoved; }

/// When a server ends by itself. Another engine does not begin it anew.
struct Duration {
  std::optional<double> wanted_s;
  std::optional<std::int64_t> end_ns = {};  // empty while the server claims the session's name
  bool ran = false;                         // a frame was made
  std::atomic<bool> awaits_none = false;    // no further engine is awaited: it is over, or a signal came

  void note(host::Host::State state, std::int64_t now_ns) {
    using State = host::Host::State;
    const bool begins = state == State::kRunning ? !std::exchange(ran, true) : !end_ns;
    if ((state != State::kRunning && state != State::kWaiting) || !begins) return;
    end_ns = now_ns + (wanted_s ? static_cast<std::int64_t>(*wanted_s * 1e9) : INT64_MAX / 4);
  }
  [[nodiscard]] bool over(std::int64_t now_ns) const { return end_ns && now_ns >= *end_ns; }
};

Ending serve(host::Host& host, transport::ServerPort& port, ScriptSender& script, HashLog& hashes,
             host::Keeping& keeping, const host::Publisher& publisher, Metrics& metrics, Service& service,
             DaemonOptions& options, Duration& duration, const std::atomic<bool>& stop) {
  Console console;
  FailureLog failures(publisher);
  hashes.add(host.session().streams[host.first_made()].carries, host.frame(), host.hash());
  while (!stop.load(std::memory_order_relaxed)) {
    const std::int64_t now_ns = steady_ns();
    const bool produced = host.poll(now_ns, wall_ns());
    metrics.watch(host, publisher, keeping, produced, now_ns);
    service.watch(host, now_ns);
    service.reload(options, host, keeping, now_ns);
    if (produced) log_frame(host, hashes);
    keeping.after_poll(host, produced, now_ns);
    if (host.error()) return Ending::kRefused;
    if (host.state() == host::Host::State::kHandedOver) return Ending::kHandedOver;
    duration.note(host.state(), now_ns);
    if (host.state() == host::Host::State::kRunning) script.send_due(host);
    console.show(host, keeping.figures(), now_ns);
    failures.show(now_ns);
    if (network_moved()) {
      finish_frame(host, port, hashes);
      return Ending::kMoved;
    }
    if (publisher.gave_up()) return Ending::kCannotWrite;
    if (duration.over(now_ns)) return duration.ran ? Ending::kDone : Ending::kNobodyCame;
    host::wait_for_work(host, port, std::chrono::nanoseconds(host.next_wake_ns() - steady_ns()));
  }
  finish_frame(host, port, hashes);
  return Ending::kDone;
}

Json json_of(const checkpoint::Figures& figures) {
  return {{"written", figures.written},
          {"failed", figures.failed},
          {"frame", figures.frame},
          {"bytes", figures.bytes},
          {"age_s", figures.age_s ? Json(*figures.age_s) : Json()},
          {"copy_ms_max", figures.copy_ms_max},
          {"write_ms_max", figures.write_ms_max}};
}

[[nodiscard]] Result<void> print_report(const host::HostTotals& totals,
                                        const std::optional<checkpoint::Figures>& checkpoints,
                                        double frame_rate_hz, bool json) {
  const double per_frame = totals.frames == 0 ? 0 : 1 / static_cast<double>(totals.frames);
  const double mbit_per_s =
      static_cast<double>(totals.payload_bytes) * 8 / kBitsPerMbit * per_frame * frame_rate_hz;
  spdlog::info(
      "{} frames, {:.3f} Mbit/s at the nominal rate, {:.2f} ms a frame (p99 {:.2f}), {} clients, {} stalls "
      "({} ms), {} inputs refused",
      totals.frames, mbit_per_s, totals.frame_ms_p50, totals.frame_ms_p99, totals.clients_seen, totals.stalls,
      totals.suspended_ms, totals.refused_inputs);
  if (checkpoints) {
    spdlog::info(
        "{} checkpoints, {} failed, the last of frame {} with {} bytes; a frame was delayed by {:.2f} ms at most",
        checkpoints->written, checkpoints->failed, checkpoints->frame, checkpoints->bytes,
        checkpoints->copy_ms_max);
  }
  if (!json) return {};
  Json streams = Json::array();
  for (const host::StreamTotals& stream : totals.streams) {
    const double bits = static_cast<double>(stream.payload_bytes) * 8 / kBitsPerMbit;
    streams.push_back(
        {{"name", stream.name},
         {"delay", 1e-3 * stream.delay_ms},
         {"frames", stream.frames},
         {"messages", stream.messages},
         {"mbit_per_s", stream.frames == 0 ? 0 : bits / static_cast<double>(stream.frames) * frame_rate_hz},
         {"snapshots", stream.snapshots},
         {"snapshot_bytes", stream.snapshot_bytes}});
  }
  Json object{{"frames", totals.frames},
              {"mbit_per_s", mbit_per_s},
              {"frame_ms", {{"p50", totals.frame_ms_p50}, {"p99", totals.frame_ms_p99}}},
              {"clients_seen", totals.clients_seen}};
  each_server_count([&object](const char* name, std::uint64_t count) { object[name] = count; }, totals);
  object["demotions"] = totals.demotions;
  object["hidden_bodies"] = totals.hidden;
  object["streams"] = std::move(streams);
  if (checkpoints) object["checkpoint"] = json_of(*checkpoints);
  const std::string line = object.dump() + '\n';
  if (std::fputs(line.c_str(), stdout) < 0 || std::fflush(stdout) != 0)
    return fail(ErrorCode::kIo, "the report could not be written to stdout");
  return {};
}

/// True for a session of one stream without a name.
bool is_alone(const std::vector<host::StreamConfig>& streams) { return streams[0].name.empty(); }

/// Finishes the hash log, reports the result, and returns the exit code.
int tell_end(const host::Host& host, Ending ending, HashLog& hashes, const host::Keeping& keeping,
             const std::vector<host::StreamConfig>& streams, double frame_rate_hz,
             const DaemonOptions& options, Verdict& verdict) {
  const auto closed = hashes.close();
  if (!closed) verdict.fail(closed.error(), 1);
  if (ending == Ending::kRefused) return verdict.fail(*host.error(), 1);
  for (std::uint32_t id = 0; id < host::encoding_offers(streams); ++id) {
    const std::string which = is_alone(streams) ? std::string() : " of stream " + streams[id].name;
    if (streams[id].quality) spdlog::info("threshold{} at the end: {:.4g} m", which, host.threshold_m(id));
    if (const std::string gains = gains_text(host.parameters(id)); !gains.empty())
      spdlog::info("at the end{}: {}", which, gains);
  }
  const auto printed = print_report(host.totals(), keeping.figures(), frame_rate_hz, options.json);
  if (!printed) verdict.fail(printed.error(), 1);
  if (ending == Ending::kCannotWrite) {
    return verdict.fail({ErrorCode::kTransport, "a frame could not be written for 10 s; ending"}, 1);
  }
  if (ending == Ending::kHandedOver)
    spdlog::info("another server continues the session from frame {}", host.frame());
  if (ending == Ending::kNobodyCame) {
    return verdict.fail({ErrorCode::kTimeout, fmt::format("fewer than {} participants came within {} s",
                                                          options.wait_for, *options.duration_s)},
                        1);
  }
  return closed && printed ? 0 : 1;
}

/// How a life of a server ended.
struct End {
  enum class Next : std::uint8_t { kExit, kStandBy, kAnotherEngine, kAnotherNetwork };
  Next next = Next::kExit;
  int exit_code = 0;
  bool was_live = false;      ///< it did not stand by any more
  bool had_standbys = false;  ///< another server may take over now
  /// For another network: the world, and who published it.
  std::shared_ptr<const checkpoint::Checkpoint> world = nullptr;
  transport::ParticipantId from = {};
};

/// The world goes on by another network address, if the engine can save it.
std::optional<End> move_on(const host::Host& host, const ServedWorld& served,
                           const transport::ServerPort& port, Verdict& verdict) {
  std::string line;
  static_cast<void>(transport::dds_server_network(&line));
  const bool saves = served.door == nullptr || served.door->hello().saves;
  if (!saves || host.frame_under_way() || host.error()) {
    verdict.fail(
        {ErrorCode::kTransport, fmt::format("{}: this server ends, to be started again by it", line)}, 1);
    return std::nullopt;
  }
  spdlog::warn("{}: the session goes on by it, in another epoch", line);
  auto world = std::make_shared<checkpoint::Checkpoint>();
  host.capture(*world);
  return End{End::Next::kAnotherNetwork, 1, true, false, std::move(world), port.self()};
}

/// What stays from one life of a server to the next: it may stand by again, or go on with another engine.
struct Stage {
  DaemonOptions& options;  ///< with what was read again
  const ServedWorld& served;
  const bool& stands_by;  ///< this life begins so
  HashLog& hashes;
  Metrics& metrics;
  Service& service;
  SignalWatch& signals;
  Verdict& verdict;
  Duration& duration;
  const bool& first;  // of the lives of this server
};

/// Waits while there is no network, which may come and go; an engine that fails, or the end, ends that.
Result<std::unique_ptr<transport::ServerPort>> open_port_again(const Stage& stage,
                                                               const host::HostConfig& config) {
  const std::atomic<bool>& stop = stage.signals.stop();
  bool told = false;
  for (;;) {
    auto port = open_port(config, stage.options, stage.metrics, stop);
    if (port || port.error().code != ErrorCode::kTransport || stop || stage.duration.over(steady_ns()))
      return port;
    if (std::string why = stage.served.simulation->failure(); !why.empty())
      return fail(ErrorCode::kIo, std::move(why));
    if (!std::exchange(told, true)) spdlog::warn("{}; tried again until it can be", port.error().message);
    stage.service.watch(steady_ns());
    stage.metrics.miss_network(steady_ns());
    std::this_thread::sleep_for(std::chrono::milliseconds{500});
  }
}

End live(const Stage& stage, host::HostConfig config, transport::ServerPort& port, host::Keeping& keeping) {
  DaemonOptions& options = stage.options;
  SignalWatch& signals = stage.signals;
  Verdict& verdict = stage.verdict;
  engine::Simulation& simulation = *stage.served.simulation;
  const auto exits = [&signals](int code) { return End{End::Next::kExit, signals.finish(code)}; };
  if (stage.stands_by) {
    const auto takes_over =
        stand_by(options, simulation, port, config, keeping, stage.service, stage.metrics, signals.stop());
    if (!takes_over && network_moved()) {
      spdlog::warn("{}: stands by anew", takes_over.error().message);
      return {End::Next::kStandBy};
    }
    if (!takes_over && !simulation.failure().empty())
      return {End::Next::kAnotherEngine, verdict.fail({ErrorCode::kIo, simulation.failure()}, 1)};
    if (!takes_over) return exits(verdict.fail(takes_over.error(), 1));
    if (!*takes_over) return exits(0);
  }
  const bool goes_on = config.goes_on_from != nullptr;
  stage.hashes.begin(config.epoch);
  const double frame_rate_hz = config.frame_rate_hz;
  const std::vector<host::StreamConfig> streams = config.streams;
  auto host = host::Host::create(std::move(config), simulation, port);
  if (!host) {
    const int exit_code = verdict.fail(host.error(), options.standby ? 1 : 2);
    // Another engine may say what no session can have; the one after it may not.
    if (stage.served.door != nullptr && !stage.first) {
      stage.served.door->dismiss(verdict.why());
      return {End::Next::kAnotherEngine, exit_code, true};
    }
    return exits(exit_code);
  }
  logging::set_context(options.session, (*host)->session().epoch);
  const bool alone = is_alone(streams);
  const std::uint32_t encoded = host::encoding_offers(streams);
  spdlog::info("scene {}, {} bodies, {}, session '{}' on domain {}, epoch {}", stage.served.world.name,
               simulation.capacity(), alone ? coding_text(streams[0]) : fmt::format("{} streams", encoded),
               options.session, options.domain, (*host)->session().epoch);
  for (std::size_t id = 0; id < encoded && !alone; ++id)
    spdlog::info("stream {}: {}", streams[id].name, coding_text(streams[id]));

  host::Publisher publisher((*host)->outbox(), port);
  ScriptSender script(stage.served.scene, options);
  if (goes_on) script.skip_to((*host)->frame());
  const Ending ending = serve(**host, port, script, stage.hashes, keeping, publisher, stage.metrics,
                              stage.service, options, stage.duration, signals.stop());
  if (options.engine && (*host)->state() == host::Host::State::kEnded && !signals.stop()) {
    publisher.flush();  // what was made reaches the clients before the writers are gone
    return {End::Next::kAnotherEngine, verdict.fail(*(*host)->error(), 1), true,
            (*host)->wants_checkpoints()};
  }
  if (ending == Ending::kRefused && options.standby) {
    spdlog::warn("{}; this one stands by again", (*host)->error()->message);
    return {End::Next::kStandBy};
  }
  keeping.end(**host);
  if (ending == Ending::kMoved) {
    if (auto end = move_on(**host, stage.served, port, verdict)) return std::move(*end);
    return exits(1);
  }
  // Reports before the last writes, so that nothing else is lost if DDS blocks one of them.
  const int exit_code = signals.finish(
      tell_end(**host, ending, stage.hashes, keeping, streams, frame_rate_hz, options, verdict));
  publisher.flush();
  publisher.stop();
  if (publisher.failures() > 0) {
    spdlog::warn("{} writes failed in all, the last: {}", publisher.failures(), publisher.last_failure());
  }
  return {End::Next::kExit, exit_code};
}

Result<host::HostConfig> plan(const ServedWorld& served, const DaemonOptions& options) {
  auto config =
      planning::plan_server(served.world, static_cast<const planning::Wishes&>(options.choice), options);
  if (config || served.door == nullptr) return config;
  return fail(config.error().code, fmt::format("the engine {} cannot be served: {}",
                                               served.door->hello().name, config.error().message));
}

/// Waits for the time of another engine, and opens it. Returns an exit code instead if there shall be none.
tl::expected<ServedWorld, int> next_engine(const DaemonOptions& options, Restarts& restarts, Service& service,
                                           Metrics& metrics, std::int64_t ran_ns, const End& end,
                                           const std::atomic<bool>& stop, Verdict& verdict,
                                           Duration& duration) {
  // A server that stands by takes over meanwhile, and this one then finds it.
  constexpr std::int64_t kTakeoverNs = 4 * kSecond;
  const int exit_code = end.exit_code;
  for (;;) {
    auto wait_ns = restarts.wait_after_ns(ran_ns);
    if (wait_ns && end.had_standbys) wait_ns = std::max(*wait_ns, kTakeoverNs);
    // An inherited socket leads to one engine only.
    if (options.engine->descriptor >= 0) return tl::unexpected(exit_code);
    if (!wait_ns) {
      spdlog::error("the engine ended {} times, each time soon after its start; giving up",
                    Restarts::kMaxInARow + 1);
      return tl::unexpected(exit_code);
    }
    spdlog::warn("another engine is {} in {:.1f} s", options.engine->command.empty() ? "awaited" : "started",
                 static_cast<double>(*wait_ns) * 1e-9);
    const std::int64_t until_ns = steady_ns() + *wait_ns;
    const auto idle = [&service, &metrics, &duration, &stop](bool engine_there) {
      service.watch(steady_ns());
      if (!engine_there) metrics.miss_engine(steady_ns());
      if (stop || duration.over(steady_ns())) duration.awaits_none = true;
    };
    while (steady_ns() < until_ns && !duration.awaits_none) {
      idle(false);
      std::this_thread::sleep_for(std::chrono::milliseconds{20});
    }
    if (duration.awaits_none) return tl::unexpected(stop ? 0 : exit_code);
    auto served = open_world(options, duration.awaits_none, idle);
    const auto planned = served ? plan(*served, options) : Result<host::HostConfig>();
    if (served && planned) return std::move(*served);
    if (served) {
      verdict.fail(planned.error(), 1);
      if (served->door != nullptr) served->door->dismiss(verdict.why());
    }
    if (duration.awaits_none) return tl::unexpected(stop ? 0 : exit_code);
    if (!served) verdict.fail(served.error().error, 1);
    ran_ns = 0;
  }
}

int run(DaemonOptions& options, SignalWatch& signals, ServedWorld& served, Verdict& verdict) {
  Metrics metrics;
  Service service;
  if (options.engine && !options.engine->host.empty() &&
      !metrics::is_loopback({.host = options.engine->host}))
    spdlog::warn(
        "--engine-listen: nothing between {} and the engine is encrypted, its token neither; use a network that you "
        "trust, or a tunnel (ssh -R)",
        options.engine->host);
  auto opened_world = open_world(options, signals.stop(), [&service](bool engine_there) {
    engine_there ? service.watch(steady_ns()) : service.await_engine(steady_ns());
  });
  if (!opened_world) {
    const NotOpened& why = opened_world.error();
    if (signals.stop()) return signals.finish(0);
    return verdict.fail(placed(options.places, why.field, why.error), why.exit_code);
  }
  served = std::move(*opened_world);
  if (!served.session.empty() && options.session == DaemonOptions().session) options.session = served.session;
  if (const auto named = transport::check_session_name(options.session); !named)
    return verdict.fail(named.error(), 2);
  if (const auto good = check_identity(options); !good) return verdict.fail(good.error(), 2);
  HashLog hashes;
  Restarts restarts;
  bool stands_by = options.standby;
  const engine::door::Door* door = nullptr;  // that the metrics follow
  bool first = true;
  Duration duration{options.duration_s};
  std::optional<End> moved;  // the last life, if this one goes on by another network
  const Stage stage{options, served, stands_by, hashes, metrics, service, signals, verdict, duration, first};
  for (;; first = false) {
    const std::int64_t began_ns = steady_ns();
    auto config = plan(served, options);
    if (!config) return verdict.fail(placed(options.places, "", config.error()), 2);
    config->engine = served.engine;
    config->pipeline = options.pipeline;
    if (served.door != nullptr && served.door != door) metrics.begin_engine(*(door = served.door));
    std::optional<End> end;
    {
      auto keeping = stands_by || moved ? host::Keeping::stand_by(options.checkpoint, &log_line, &steady_ns)
                                        : host::Keeping::begin(options.checkpoint, *served.simulation,
                                                               *config, &log_line, &steady_ns);
      if (!keeping && signals.stop()) return signals.finish(0);
      if (!keeping) return verdict.fail(keeping.error(), 1);
      // Another life has another DDS participant, so that nobody takes it for the server that it was.
      auto port =
          first ? open_port(*config, options, metrics, signals.stop()) : open_port_again(stage, *config);
      if (!port && signals.stop()) return signals.finish(0);
      if (!port)
        return verdict.fail(port.error(), first && port.error().code != ErrorCode::kTransport ? 2 : 1);
      if (first) {
        if (const auto warning = transport::warning_without_security(options.profile, options.secure);
            !warning.empty())
          spdlog::warn("{}", warning);
        if (const std::string notice = transport::dds_start_notice(); !notice.empty())
          spdlog::info("{}", notice);
        if (!options.profile.empty())
          spdlog::info("{}", transport::describe_dds_profile(options.domain, options.profile,
                                                             transport::Side::kServer));
        if (const auto opened = hashes.open(options.hash_log, host::encoding_offers(config->streams));
            !opened)
          return signals.finish(verdict.fail(opened.error(), 1));
        if (options.metrics) {
          auto answers = metrics.serve(
              *options.metrics, facts_of(*config, options.session, served.world.name, options.free_rate));
          if (!answers) return signals.finish(verdict.fail(answers.error(), 1));
        }
      }
      if (moved) {
        const auto taken =
            keeping->take_over(moved->world, moved->from, config->epoch, *served.simulation, *config);
        if (!taken) return signals.finish(verdict.fail(taken.error(), 1));
      }
      end = live(stage, std::move(*config), **port, *keeping);
    }
    if (end->next == End::Next::kExit) return end->exit_code;
    moved.reset();
    if (end->next == End::Next::kAnotherNetwork) moved = std::move(end);
    logging::set_context(options.session, 0);
    // A server that lost its engine or its network goes on as the live one, unless another has taken over.
    stands_by = options.standby && !moved && !(end->next == End::Next::kAnotherEngine && end->was_live);
    if (moved || end->next != End::Next::kAnotherEngine) continue;
    metrics.miss_engine(steady_ns());
    door = served.door = nullptr;
    served.simulation.reset();  // it holds the place at which the next engine is awaited
    auto next = next_engine(options, restarts, service, metrics, steady_ns() - began_ns, *end, signals.stop(),
                            verdict, duration);
    if (!next) return signals.finish(next.error());
    served = std::move(*next);
  }
}

}  // namespace

int run_daemon(DaemonOptions options, SignalWatch& signals) {
  ServedWorld served;  // outlives all else, so that its engine hears how it ended
  Verdict verdict;
  const int exit_code = run(options, signals, served, verdict);
  if (exit_code != 0 && served.door != nullptr) served.door->dismiss(verdict.why());
  return exit_code;
}

}  // namespace tandem::daemon
