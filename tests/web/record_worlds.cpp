// Writes what a gateway would send a viewer of each world of tests/support/worlds, with the hash of every
// frame as this machine computes it.
//
//   record_worlds FOLDER
//
// FOLDER/NAME.trace: see trace_file.hpp. FOLDER/NAME.json: the frames with their hashes. FOLDER/worlds.json:
// the names.

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>

#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/port.hpp"
#include "services/program/json/json.hpp"
#include "tests/property/random.hpp"
#include "tests/support/worlds/worlds.hpp"
#include "tests/web/trace_file.hpp"

namespace tandem {
namespace {

using worlds::World;

constexpr Epoch kEpoch = 1'700'000'000'000;
constexpr double kFrameMs = 1000.0 / 30;

transport::SessionMessage announcement_of(const World& world, const ServerTimeline& server) {
  transport::SessionMessage session;
  session.session = "worlds";
  session.epoch = kEpoch;
  session.capacity = world.layout.capacity;
  session.lattice_unit = 1.0 / 20'000;
  session.scene = world.name;
  session.types.resize(world.layout.type_count);
  transport::StreamMessage stream;
  stream.max_delta_bytes = static_cast<std::uint32_t>(server.payload_bound());
  stream.max_snapshot_bytes = static_cast<std::uint32_t>(server.snapshot_bound());
  stream.layout = world.layout;
  stream.layout_hash = transport::layout_hash(session, stream);
  session.streams.push_back(std::move(stream));
  return session;
}

// The bodies go where the predicted step says, but for one in a dozen, which is somewhat beside it.
State target_of(State state, Predictor& step, const StepInput& input, synthetic::Random& random) {
  step.step(state, state, input);
  for (Slot s = 0; s < state.capacity(); ++s) {
    if (state.alive()[s] == 0 || !random.one_in(12)) continue;
    BodyState body = state.body(s);
    for (std::int32_t& p : body.p)
      p = static_cast<std::int32_t>(std::clamp<std::int64_t>(
          std::int64_t{p} + random.even(3 * input.threshold), -kPositionLimit, kPositionLimit));
    state.set_body(s, body);
  }
  return state;
}

bool record(const World& world, const std::string& path) {
  auto server = ServerTimeline::create(world.layout, kEpoch);
  auto step = make_predictor(world.layout.predictor, world.layout.capacity, world.layout.predictor_constants);
  if (!server || !step) {
    std::fprintf(stderr, "%s\n", (server ? step.error() : server.error()).message.c_str());
    return false;
  }
  TraceFile trace(path);
  Json told;
  trace.write(announcement_of(world, *server), 0);
  server->start(0, world.start, world.drive);
  transport::SnapshotMessage snapshot;
  snapshot.epoch = kEpoch;
  server->snapshot(snapshot.bytes);
  snapshot.total_bytes = static_cast<std::uint32_t>(snapshot.bytes.size());
  trace.write(snapshot, 1);
  synthetic::Random random(5);
  Drive drive = world.drive;
  for (Frame frame = 1; frame <= worlds::kFrames; ++frame) {
    const double at_ms = static_cast<double>(frame) * kFrameMs;
    const StepInput input = worlds::input_at(world, frame);
    if (input.drive != drive) {
      drive = input.drive;
      const auto [x, y, z] = drive.gravity;
      transport::ScheduledInputMessage scheduled{kEpoch,
                                                 server->last_input() + 1,
                                                 frame,
                                                 0,
                                                 0,
                                                 static_cast<std::uint32_t>(transport::ScheduledKind::kDrive),
                                                 {x, y, z, drive.damping}};
      if (!server->schedule({scheduled.number, frame, drive})) return false;
      trace.write(scheduled, at_ms);
    }
    const auto result = server->advance(target_of(server->state(), **step, input, random), {});
    transport::DeltaMessage delta;
    delta.epoch = kEpoch;
    delta.frame = result.frame;
    delta.last_input = result.last_input;
    delta.server_time_ns = static_cast<std::int64_t>((static_cast<double>(kEpoch) + at_ms) * 1e6);
    delta.hash = result.hash;
    delta.payload.assign(result.payload.begin(), result.payload.end());
    trace.write(delta, at_ms);
    told["frames"].push_back(Json::array({result.frame, to_hex(result.hash), result.corrected}));
  }
  std::ofstream out(path + ".json");
  out << told.dump() << '\n';
  return trace.finish() && out.flush().good();
}

int run(const std::string& folder) {
  Json names = Json::array();
  for (const World& world : worlds::all_worlds()) {
    if (!record(world, folder + '/' + world.name)) {
      std::fprintf(stderr, "record_worlds: %s failed\n", world.name.c_str());
      return 1;
    }
    names.push_back(world.name);
  }
  std::ofstream out(folder + "/worlds.json");
  out << names.dump() << '\n';
  return out.flush().good() ? 0 : 1;
}

}  // namespace
}  // namespace tandem

int main(int argc, char** argv) { return argc == 2 ? tandem::run(argv[1]) : 2; }
