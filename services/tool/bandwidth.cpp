#include "services/tool/bandwidth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace tandem::tool {
namespace {

constexpr Epoch kEpoch = 1;

/// Durations of one kind; the median at the end.
class Durations {
 public:
  void add(double ms) { ms_.push_back(static_cast<float>(ms)); }
  [[nodiscard]] double median() {
    if (ms_.empty()) return 0;
    const auto middle = ms_.begin() + static_cast<std::ptrdiff_t>(ms_.size() / 2);
    std::nth_element(ms_.begin(), middle, ms_.end());
    return *middle;
  }

 private:
  std::vector<float> ms_;
};

/// One session's server and client, and what they were seen to do.
struct Lane {
  Lane(const server::HostConfig& config, ServerTimeline server_side, ClientTimeline client_side)
      : session(&config), server(std::move(server_side)), client(std::move(client_side)) {}

  const server::HostConfig* session;
  ServerTimeline server;
  ClientTimeline client;
  std::uint64_t payload_bytes = 0, corrected = 0, body_frames = 0;
  double max_squared = 0, sum_squared = 0;
  Durations predict, encode, decode, apply;
};

/// Sessions on one trajectory may differ in how fast c decays.
Drive drive_of(const server::HostConfig& session, Drive drive) {
  drive.decay = session.decay;
  return drive;
}

Result<Lane> make_lane(const server::HostConfig& session, const Replay& replay) {
  const TimelineConfig config = server::timeline_config(session, replay.simulation().capacity());
  auto server = ServerTimeline::create(config, kEpoch);
  if (!server) return tl::unexpected(server.error());
  auto client = ClientTimeline::create(config);
  if (!client) return tl::unexpected(client.error());
  server->set_clock(&steady_ns);
  client->set_clock(&steady_ns);
  server->start(0, replay.target(), drive_of(session, replay.start_drive()));
  std::vector<std::byte> snapshot;
  server->snapshot(snapshot);
  if (auto loaded = client->load(snapshot, kEpoch); !loaded) return tl::unexpected(loaded.error());
  return Lane(session, std::move(*server), std::move(*client));
}

/// Euclidean distance of the agreed state to the simulation's floats, over all bodies that are shown.
void add_errors(const State& agreed, const engine::Bodies& bodies, double unit, Lane& lane) {
  const std::span<const std::uint8_t> alive = agreed.alive();
  for (std::size_t i = 0; i < alive.size(); ++i) {
    if (alive[i] == 0) continue;
    double squared = 0;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const double off = agreed.p(channel)[i] * unit - double{bodies.position[channel][i]};
      squared += off * off;
    }
    lane.max_squared = std::max(lane.max_squared, squared);
    lane.sum_squared += squared;
    ++lane.body_frames;
  }
}

/// One frame of one session: the server's half, then the client's.
Result<void> advance(Lane& lane, const Replay& replay) {
  for (ScheduledDrive input : replay.scheduled()) {
    input.drive = drive_of(*lane.session, input.drive);
    auto scheduled = lane.server.schedule(input).and_then([&] { return lane.client.schedule(input); });
    if (!scheduled) return scheduled;
  }
  const ServerTimeline::FrameResult frame =
      lane.server.advance(replay.target(), replay.lifecycle(), lane.session->budget);
  lane.predict.add(frame.predict_ms);
  lane.encode.add(frame.encode_ms + replay.mirror_ms());
  lane.payload_bytes += frame.payload.size();
  lane.corrected += frame.corrected;

  lane.client.step(1);
  auto applied = lane.client.apply(frame.frame, frame.last_input, frame.hash, frame.payload);
  lane.decode.add(lane.client.timings().decode_ms);
  lane.apply.add(lane.client.timings().apply_ms);
  if (!applied) return applied;
  add_errors(lane.client.state(frame.frame), replay.simulation().bodies(), lane.session->lattice.unit, lane);
  return {};
}

/// What a lane measured over `frames` frames.
BandwidthRow row_of(Lane& lane, double frames) {
  const server::HostConfig& session = *lane.session;
  BandwidthRow row;
  row.codec = session.codec;
  row.predictor = session.predictor;
  const double bits_per_frame = 8.0 * static_cast<double>(lane.payload_bytes) / frames;
  row.mbit_per_s = bits_per_frame / session.lattice.dt_s / static_cast<double>(1U << 20U);
  row.max_error = std::sqrt(lane.max_squared);
  if (lane.body_frames > 0)
    row.rms_error = std::sqrt(lane.sum_squared / static_cast<double>(lane.body_frames));
  row.corrected_per_frame = static_cast<double>(lane.corrected) / frames;
  row.predict_ms = lane.predict.median();
  row.encode_ms = lane.encode.median();
  row.decode_ms = lane.decode.median();
  row.apply_ms = lane.apply.median();
  return row;
}

}  // namespace

Result<std::vector<BandwidthRow>> measure_bandwidth(Replay& replay,
                                                    std::span<const server::HostConfig> sessions,
                                                    std::uint64_t frames,
                                                    const std::function<void(Frame)>& progress) {
  std::vector<Lane> lanes;
  lanes.reserve(sessions.size());
  for (const server::HostConfig& session : sessions) {
    auto lane = make_lane(session, replay);
    if (!lane)
      return fail(lane.error().code, fmt::format("codec {}: {}", session.codec, lane.error().message));
    lanes.push_back(std::move(*lane));
  }
  Durations step;
  std::uint64_t colliding = 0;
  for (Frame frame = 1; frame <= frames; ++frame) {
    if (auto stepped = replay.next(); !stepped) return tl::unexpected(stepped.error());
    step.add(replay.step_ms());
    colliding += replay.simulation().colliding();
    for (Lane& lane : lanes) {
      if (auto advanced = advance(lane, replay); !advanced) {
        return fail(advanced.error().code, fmt::format("codec {}, frame {}: {}", lane.session->codec, frame,
                                                       advanced.error().message));
      }
    }
    progress(frame);
  }

  const double step_ms = step.median();
  std::vector<BandwidthRow> rows;
  for (Lane& lane : lanes) {
    rows.push_back(row_of(lane, static_cast<double>(frames)));
    rows.back().bodies = replay.simulation().capacity();
    rows.back().frames = frames;
    rows.back().colliding_per_frame = static_cast<double>(colliding) / static_cast<double>(frames);
    rows.back().step_ms = step_ms;
  }
  return rows;
}

std::optional<double> paper_mbit_per_s(int scene, std::uint32_t bodies, std::string_view codec) {
  constexpr std::array<std::string_view, 5> codecs{"none", "selective", "quantized", "entropy", "limited"};
  struct Line {
    int scene;
    std::uint32_t bodies;
    std::array<double, 5> mbit_per_s;
  };
  static constexpr Line kTable53[] = {
      {1, 5000, {27.47, 2.41, 0.89, 0.65, 0.65}}, {1, 10000, {54.93, 5.26, 1.87, 1.35, 1.20}},
      {2, 5000, {27.47, 2.32, 0.89, 0.71, 0.66}}, {2, 10000, {54.93, 5.66, 2.07, 1.60, 1.15}},
      {3, 5000, {27.47, 7.46, 2.67, 1.86, 1.37}}, {3, 10000, {54.93, 15.84, 5.60, 4.00, 1.43}},
      {4, 5000, {27.47, 2.07, 0.80, 0.57, 0.57}}, {4, 10000, {54.93, 4.29, 1.62, 1.15, 1.06}},
      {5, 5000, {27.47, 9.46, 3.26, 2.23, 1.44}}, {5, 10000, {54.93, 20.07, 6.82, 4.73, 1.45}},
  };
  const auto* const column = std::find(codecs.begin(), codecs.end(), codec);
  if (column == codecs.end()) return std::nullopt;
  for (const Line& line : kTable53) {
    if (line.scene == scene && line.bodies == bodies) {
      return line.mbit_per_s[static_cast<std::size_t>(column - codecs.begin())];
    }
  }
  return std::nullopt;
}

std::string to_json(std::span<const BandwidthRow> rows) {
  using Json = nlohmann::ordered_json;
  Json list = Json::array();
  for (const BandwidthRow& row : rows) {
    list.push_back(
        {{"scene", row.scene},
         {"number", row.number ? Json(*row.number) : Json(nullptr)},
         {"bodies", row.bodies},
         {"codec", row.codec},
         {"predictor", row.predictor},
         {"threads", row.threads},
         {"seed", row.seed},
         {"frames", row.frames},
         {"threshold", row.threshold},
         {"mbit_per_s", row.mbit_per_s},
         {"max_error", row.max_error},
         {"rms_error", row.rms_error},
         {"corrected_per_frame", row.corrected_per_frame},
         {"colliding_per_frame", row.colliding_per_frame ? Json(*row.colliding_per_frame) : Json(nullptr)},
         {"step_ms", row.step_ms},
         {"predict_ms", row.predict_ms},
         {"encode_ms", row.encode_ms},
         {"decode_ms", row.decode_ms},
         {"apply_ms", row.apply_ms}});
  }
  return Json{{"rows", list}}.dump();
}

std::string to_table(std::span<const BandwidthRow> rows) {
  std::string text = fmt::format(
      "{:<12} {:>7} {:<10} {:>8} {:>7} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8} {:>8} {:>8} {:>8}\n",
      "scene", "bodies", "codec", "Mbit/s", "paper", "max err", "rms err", "threshold", "corrected",
      "colliding", "step ms", "predict", "encode", "decode", "apply");
  for (const BandwidthRow& row : rows) {
    const auto paper = row.number ? paper_mbit_per_s(*row.number, row.bodies, row.codec) : std::nullopt;
    text += fmt::format(
        "{:<12} {:>7} {:<10} {:>8.3f} {:>7} {:>9.5f} {:>9.5f} {:>9.5f} {:>9.1f} {:>9} {:>8.3f} {:>8.3f} "
        "{:>8.3f} {:>8.3f} {:>8.3f}\n",
        row.scene, row.bodies, row.codec, row.mbit_per_s, paper ? fmt::format("{:.2f}", *paper) : "-",
        row.max_error, row.rms_error, row.threshold, row.corrected_per_frame,
        row.colliding_per_frame ? fmt::format("{:.0f}", *row.colliding_per_frame) : "-", row.step_ms,
        row.predict_ms, row.encode_ms, row.decode_ms, row.apply_ms);
  }
  return text;
}

}  // namespace tandem::tool
