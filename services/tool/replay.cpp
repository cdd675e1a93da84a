// `tandem replay`: publishes a recorded session again, as a server that computes nothing new.

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <thread>

#include "sdk/transport/network/reach.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/publisher.hpp"
#include "services/program/configuration/common.hpp"
#include "services/program/process/heap.hpp"
#include "services/program/process/signal_watch.hpp"
#include "services/program/token_bucket.hpp"
#include "services/tool/commands.hpp"
#include "services/tool/endpoint_options.hpp"
#include "services/tool/log_options.hpp"
#include "services/tool/recorded_source.hpp"

namespace tandem::tool {
namespace {

using recording::Playback;
using Step = Playback::Step;
using transport::steady_ns;
using transport::wall_ns;

struct ReplayOptions {
  std::string file;
  std::uint32_t domain = 0;
  std::string profile = {};  ///< of the network
  std::string secure;
  std::string session = "default";
  double rate = 1;
  double from_s = 0;
  bool loop = false;
  std::uint32_t wait_for = 0;
  logging::LogOptions log;
};

// Readers get this time to take what was written last.
constexpr std::chrono::milliseconds kTakingFrames(500), kTakingReplies(50);

/// The result of serving one run.
struct Served {
  Step behind = Step::kFrame;      ///< the next step in the file; kFrame if it was stopped before its end
  std::optional<double> sought_s;  ///< the time at which a client wants to continue
};

/// The data that all runs of a replay share.
struct ReplayState {
  Epoch epoch = 0;      ///< the last; 0 before the first
  bool sought = false;  ///< a client has sought
  /// The port of the last run. It outlives the work, so that the program can report before DDS ends.
  std::unique_ptr<transport::ServerPort> port;
  std::future<void> ending;  ///< the end of the port before; its destructor waits for that
  accounts::TokenBucket seeks{1, 1};
  std::string left_out;  ///< what has been told of the file
};

/// Ends the port of the last run and waits for that, but not beyond a stop, because DDS never ends if the
/// network interface is gone.
void end_port(ReplayState& state, const std::atomic<bool>& stop) {
  if (!state.port) return;
  state.ending = std::async(std::launch::async, [port = std::move(state.port)]() mutable { port.reset(); });
  while (!stop && state.ending.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) {
  }
}

void tell_left_out(const Playback& playback, const ReplayOptions& options, ReplayState& state) {
  std::string now = playback.left_out();
  if (now != state.left_out) spdlog::warn("{} {}", options.file, now);
  state.left_out = std::move(now);
}

/// Publishes the current run to its end, or until a client seeks. `hold`: makes no frame and does not end by
/// itself.
Result<Served> serve(Playback& playback, const ReplayOptions& options, ReplayState& state, bool hold,
                     const std::atomic<bool>& stop) {
  const bool first = state.epoch == 0;
  end_port(state, stop);
  if (stop) return Served{};
  // Each run has an epoch of its own, because the frames of an epoch are consecutive.
  tell_left_out(playback, options, state);
  state.epoch = std::max<Epoch>(state.epoch + 1, static_cast<Epoch>(wall_ns() / kMillisecond));
  host::ServiceConfig config;
  config.session = options.session;
  config.epoch = state.epoch;
  config.frame_rate_hz = std::clamp(playback.session().frame_rate_hz * options.rate, 1.0, 1000.0);
  config.window_ceiling = std::min(playback.session().window_ceiling, config.window_ceiling);
  if (first) config.wait_for = options.wait_for;
  if (hold) config.wait_for = UINT32_MAX;  // more than there can be
  config.clock_ns = &steady_ns;
  transport::DdsOptions dds;
  dds.domain = options.domain;
  dds.profile = options.profile;
  dds.session = options.session;
  dds.secure = options.secure;
  dds.delta_depth =
      transport::delta_depth(config.frame_rate_hz, config.window_ceiling, playback.stream().max_delta_bytes);
  dds.stop = &stop;
  auto port = transport::make_dds_server_port(dds);
  if (!port) return tl::unexpected(port.error());
  state.port = std::move(*port);
  if (first) tell_profile("tandem replay", options.domain, options.profile, transport::Side::kServer);
  auto frames = std::make_unique<RecordedSource>(playback, config, state.seeks);
  const RecordedSource& source = *frames;
  const auto host = host::Host::create(config, std::move(frames), *state.port);
  if (!host) return tl::unexpected(host.error());
  logging::set_context(options.session, config.epoch);
  spdlog::info("session '{}' on domain {}, epoch {}, {} slots, {} frame {} ({:.1f} s)", options.session,
               options.domain, config.epoch, playback.session().capacity, hold ? "at its end," : "from",
               source.frame(), playback.time_s());
  host::Publisher publisher((*host)->outbox(), *state.port);
  while (!stop && (*host)->state() != host::Host::State::kEnded) {
    (*host)->poll(steady_ns(), wall_ns());
    if ((*host)->error()) return tl::unexpected(*(*host)->error());
    if (publisher.gave_up())
      return fail(ErrorCode::kTransport,
                  "a frame could not be written for 10 s: " + publisher.last_failure());
    for (const std::string& notice : (*host)->take_notices()) spdlog::info(notice);
    const std::int64_t wait_ns = (*host)->next_wake_ns() - steady_ns();
    if (wait_ns > 0) state.port->wait(std::chrono::nanoseconds(wait_ns));
  }
  if (!stop) {
    publisher.flush();
    std::this_thread::sleep_for(source.sought_s() ? kTakingReplies : kTakingFrames);
  }
  return source.ending().map([&](Step behind) { return Served{behind, source.sought_s()}; });
}

// Goes to the first frame that was recorded at `from_s` or later; kEnd if there is none.
Result<Step> go_to(Playback& playback, double from_s) {
  playback.seek(from_s);
  auto step = playback.next();
  while (step && *step != Step::kEnd && playback.time_s() < from_s) step = playback.next();
  return step;
}

/// Plays from `from_s` to the end of the file, or until stopped. After a seek it stays at the end, because
/// the client may want to seek back.
Result<void> play(Playback& playback, const ReplayOptions& options, ReplayState& state,
                  const std::atomic<bool>& stop) {
  auto step = go_to(playback, options.from_s);
  if (step && *step == Step::kEnd && !playback.has_run())
    return fail(ErrorCode::kMalformed, std::string("it ") + Playback::kNothingToPlay);
  if (step && *step == Step::kEnd)
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("no frame at {:.1f} s or later; the recording has {:.1f} s", options.from_s,
                            playback.length_s()));
  while (step && !stop) {
    const bool at_end = *step == Step::kEnd;
    if (at_end && (options.loop || !state.sought)) break;
    const auto served = serve(playback, options, state, at_end, stop);
    if (!served) return tl::unexpected(served.error());
    if (served->sought_s) {
      state.sought = true;
      end_port(state, stop);  // seeking may take long
    }
    step = served->sought_s ? go_to(playback, *served->sought_s) : served->behind;
  }
  if (!step) return tl::unexpected(step.error());
  return {};
}

Result<void> replay(const ReplayOptions& options, ReplayState& state, const std::atomic<bool>& stop) {
  auto playback = Playback::open(options.file);
  if (!playback) return tl::unexpected(playback.error());
  do {
    end_port(state, stop);
    const auto played = play(**playback, options, state, stop);
    tell_left_out(**playback, options, state);
    if (!played) return fail(played.error().code, options.file + ": " + played.error().message);
  } while (options.loop && !stop);
  return {};
}

int run_replay(const ReplayOptions& options) {
  begin_log("tandem replay", options.log, options.session);
  SignalWatch signals("tandem replay", SignalWatch::Hangup::kStop,
                      {&transport::dds_fault, &logging::error, true, &transport::dds_outdated});
  const HeapTrimmer trimmer;
  if (const auto warning = transport::warning_without_security(options.profile, options.secure);
      !warning.empty())
    spdlog::warn("{}", warning);
  ReplayState state;
  const auto done = replay(options, state, signals.stop());
  if (!done) spdlog::error(done.error().message);
  return signals.finish(done ? 0 : 1);
}

}  // namespace

void add_replay(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand("replay", "Publishes a recorded session again.");
  const auto options = std::make_shared<ReplayOptions>();
  command.add_option("file", options->file, "File that `tandem record` wrote").required();
  add_endpoint_options(command, options->domain, options->profile, options->session,
                       transport::Side::kServer);
  add_secure_option(command, options->secure);
  command
      .add_option("--rate", options->rate,
                  "Speed, where 1 is that of the session; the maximum is 1000 frames per second")
      .range(0.01, 100.0)
      .show_default();
  command.add_option("--from", options->from_s, "Where to begin, in seconds from the start of the recording")
      .not_negative()
      .show_default();
  command.add_flag("--loop", options->loop, "Begin again there at the end of the recording, until stopped");
  command
      .add_option("--wait-for", options->wait_for, "Participants that must play before the very first frame")
      .range(0U, 256U)
      .show_default();
  configuration::add_log_flags(command, options->log);
  command.footer(
      "Clients can join at any frame. Each run of the recording becomes an epoch of its own; a gap in the\n"
      "recording, a restart of its server and a participant that seeks each begin another run. All inputs "
      "but\n"
      "seeks are refused. --rate changes how often frames come, but not the velocities in them. The replay "
      "ends\n"
      "with the recording, unless somebody has sought: then it stays at the end until somebody seeks or it "
      "is\n"
      "stopped. A file that is cut short is replayed up to that place. Exits with 1 if the file cannot be "
      "read.");
  command.on_chosen([options, &run] { run = [options] { return run_replay(*options); }; });
}

}  // namespace tandem::tool
