// Writes the messages that a gateway would send one viewer, from a session on a simulated network, and the
// states of a native client.
//
//   record_session --scene NAME --bodies N --frames N [--epoch N] [--codec NAME] [--predictor NAME] OUT
//
// OUT.trace: see trace_file.hpp. OUT.json: the frames with their hashes, and the bodies' positions in the
// last one. The recording client sends gravity and a push itself.

#include <cstdio>
#include <fstream>
#include <memory>
#include <string>

#include "sdk/client/client_core.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "services/commandline/commandline.hpp"
#include "services/host/host.hpp"
#include "services/json/json.hpp"
#include "services/scenes/scene.hpp"
#include "services/sessions/session_plan.hpp"
#include "tests/web/trace_file.hpp"

namespace tandem {
namespace {

constexpr std::int64_t kTickNs = kMillisecond;
constexpr std::int64_t kWallOffsetNs = 1'700'000'000 * kSecond;
constexpr std::int64_t kLongestNs = 600 * kSecond;
constexpr std::uint64_t kFramesBetweenInputs = 20;

template <class T>
T must(Result<T> result) {
  if (result) return std::move(*result);
  std::fprintf(stderr, "record_session: %s\n", result.error().message.c_str());
  std::exit(1);
}

/// Writes down what its client takes in.
class Recorder final : public client::CoreListener {
 public:
  explicit Recorder(const std::string& path) : trace_(path), path_(path) {}

  void on_session(const transport::SessionMessage& session) override {
    write(session);
    told_["epoch"] = session.epoch;
    told_["scene"] = session.scene;
    told_["capacity"] = session.capacity;
    lattice_unit_ = session.lattice_unit;
  }
  void on_scheduled(const transport::ScheduledInputMessage& input) override { write(input); }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override {
    stream_ = snapshot.stream;
    write(snapshot);
  }
  void on_applied(Epoch epoch, const client::CompleteDelta& delta) override {
    transport::DeltaMessage message;
    message.epoch = epoch;
    message.stream = stream_;
    message.frame = delta.frame;
    message.last_input = delta.last_input;
    message.server_time_ns = delta.server_time_ns;
    message.hash = delta.hash;
    message.payload = delta.payload;
    write(message);
    const ClientTimeline& timeline = *core->timeline();
    told_["frames"].push_back(
        Json::array({delta.frame, to_hex(timeline.hash()), timeline.corrected().size()}));
  }

  /// Adds the last frame and writes both files. Returns false if one cannot be written.
  [[nodiscard]] bool finish() {
    const ClientTimeline& timeline = *core->timeline();
    const State& state = timeline.state(timeline.applied());
    told_["bodies"] = state.alive_count();
    told_["at_rest"] = state.rest_count();
    Json& positions = told_["positions"] = Json::array();
    for (Slot slot = 0; slot < state.capacity(); ++slot) {
      for (std::size_t axis = 0; axis < kPositionChannels; ++axis)
        positions.push_back(static_cast<float>(state.p(axis)[slot] * lattice_unit_));
    }
    std::ofstream out(path_ + ".json");
    out << told_.dump() << '\n';
    return trace_.finish() && out.flush().good();
  }

  const client::ClientCore* core = nullptr;
  std::int64_t now_ns = 0;

 private:
  template <class M>
  void write(const M& message) {
    trace_.write(message, static_cast<double>(now_ns) / double{kMillisecond});
  }

  TraceFile trace_;
  std::string path_;
  Json told_;
  StreamId stream_;
  double lattice_unit_ = 0;
};

int run(int argc, char** argv) {
  std::string scene_name = "half_pipe";
  std::string out;
  sessions::SessionChoice choice;
  choice.bodies = 300;
  std::uint64_t frames = 300;
  Epoch epoch = 1'700'000'000'000;
  commandline::Program app("records a session for the tests of the WebAssembly module");
  app.add_option("--scene", scene_name);
  app.add_option("--bodies", choice.bodies);
  app.add_option("--frames", frames);
  app.add_option("--epoch", epoch);
  app.add_option("--codec", choice.codec);
  app.add_option("--predictor", choice.predictor);
  app.add_option("OUT", out).required();
  if (const auto code = app.parse(argc, argv)) return *code;

  const scenes::Scene scene = must(scenes::load_scene(scene_name));
  auto simulation = must(scenes::make_simulation(scene, choice.bodies, 1, 1));
  host::HostConfig config = must(sessions::plan_session(scene, choice));
  config.epoch = epoch;
  transport::simulated::Network network({});
  auto server_port = must(network.make_server(config.session));
  auto client_port = must(network.make_client(config.session));
  auto host = must(host::Host::create(config, *simulation, *server_port));
  Recorder recorder(out);
  client::CoreOptions options;
  options.id = 1;
  client::ClientCore core(options, *client_port, &recorder);
  recorder.core = &core;

  std::uint64_t sent = 0;
  for (std::int64_t now_ns = kTickNs; core.statistics().frames_applied < frames; now_ns += kTickNs) {
    if (now_ns > kLongestNs) return 1;
    network.advance_to(now_ns);
    host->poll(now_ns, now_ns + kWallOffsetNs);
    static_cast<void>(host::drain(host->outbox(), *server_port));
    recorder.now_ns = now_ns;
    const client::Now now{now_ns, now_ns + kWallOffsetNs};
    core.poll(now);
    if (core.statistics().frames_applied / kFramesBetweenInputs <= sent) continue;
    ++sent;
    const double tilt = sent % 2 == 0 ? 3 : -3;
    if (sent % 3 == 0) {
      must(core.send(transport::InputKind::kPush, {0, 1, 0, 2, tilt, 4, 0}, {}, now));
    } else {
      must(core.send(transport::InputKind::kGravity, {tilt, -9.81, 0}, {}, now));
    }
  }
  if (core.statistics().hash_mismatches + core.statistics().resyncs > 0) return 1;
  return recorder.finish() ? 0 : 1;
}

}  // namespace
}  // namespace tandem

int main(int argc, char** argv) { return tandem::run(argc, argv); }
