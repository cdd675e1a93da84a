#include "services/lab/bandwidth/bandwidth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "sdk/core/tables/codec_table.hpp"
#include "sdk/statistics/duration_histogram.hpp"
#include "sdk/transport/network/wire_bytes.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/outgoing/delta_collector.hpp"
#include "services/lab/bandwidth/peers.hpp"

namespace tandem::lab {
namespace {

constexpr Epoch kEpoch = 1;

/// Mean of frames of `dt_s` seconds, not none.
double mbit_per_s(std::span<const std::uint32_t> bytes, double dt_s) {
  const auto sum = std::accumulate(bytes.begin(), bytes.end(), std::uint64_t{0});
  return 8.0 * static_cast<double>(sum) / static_cast<double>(bytes.size()) / dt_s / kBitsPerMbit;
}

/// What deltas and all else take for one observer on DDS, over frames of `dt_s` seconds.
class Wire {
 public:
  /// An observer's usual delay.
  static constexpr std::int64_t kDelayNs = 200 * kMillisecond;

  Wire(std::uint32_t capacity, double dt_s)
      : period_ns_(std::llround(dt_s * 1e9)),
        collector_(
            {.frames = transport::max_earlier(capacity) + 1, .delay_ns = kDelayNs, .period_ns = period_ns_}) {
  }

  void add(const host::Stream::FrameResult& frame) {
    now_ns_ += period_ns_;
    collector_.take(
        {.frame = frame.frame, .hash = frame.hash, .last_input = frame.last_input, .payload = frame.payload},
        now_ns_, leaving_);
    for (const transport::DeltaMessage& delta : leaving_) add_message(delta.payload.size());
    leaving_.clear();
  }
  [[nodiscard]] double mbit_per_s() const {
    return mbit_per_s(static_cast<double>(messages_), static_cast<double>(bytes_),
                      static_cast<double>(now_ns_) * 1e-9);
  }
  /// Of payloads that travel one by one.
  static double mbit_per_s(std::span<const std::uint32_t> bytes, double dt_s) {
    const auto messages = static_cast<double>(bytes.size());
    const auto sum = std::accumulate(bytes.begin(), bytes.end(), std::uint64_t{0});
    return mbit_per_s(messages, static_cast<double>(sum) + messages * host::DeltaCollector::kFieldBytes,
                      messages * dt_s);
  }

 private:
  static double mbit_per_s(double messages, double bytes, double seconds) {
    return 8 * transport::DdsWire::of_observer(messages / seconds, bytes / seconds) / kBitsPerMbit;
  }
  void add_message(std::size_t payload_bytes) {
    ++messages_;
    bytes_ += payload_bytes + host::DeltaCollector::kFieldBytes;
  }

  std::int64_t period_ns_, now_ns_ = 0;
  std::uint64_t messages_ = 0, bytes_ = 0;
  host::DeltaCollector collector_;
  std::vector<transport::DeltaMessage> leaving_;  // kept to reuse its memory
};

/// The maximum and the root mean square of many lengths.
class Lengths {
 public:
  void add_squared(double squared) {
    max_squared_ = std::max(max_squared_, squared);
    sum_squared_ += squared;
    ++count_;
  }
  [[nodiscard]] double max() const { return std::sqrt(max_squared_); }
  /// 0 without any length.
  [[nodiscard]] double rms() const {
    return count_ == 0 ? 0 : std::sqrt(sum_squared_ / static_cast<double>(count_));
  }

 private:
  double max_squared_ = 0, sum_squared_ = 0;
  std::uint64_t count_ = 0;
};

/// The errors of what a client shows against the simulation's floats, over all bodies that are shown.
class Errors {
 public:
  /// `shown(channel, body)` in scene units.
  template <class Shown>
  void add(std::span<const std::uint8_t> alive, const engine::Bodies& bodies, const Shown& shown) {
    for (std::size_t body = 0; body < alive.size(); ++body) {
      if (alive[body] != 0) centre_.add_squared(distance_squared(bodies, body, shown));
    }
  }
  /// Does the same, and adds the maximum error of a point of the surface.
  void add(const State& agreed, const engine::Bodies& bodies, double unit,
           std::span<const std::int32_t> radii) {
    const auto shown = [&](std::size_t channel, std::size_t body) { return agreed.p(channel)[body] * unit; };
    add(agreed.alive(), bodies, shown);
    if (!agreed.groups().orientation) return;
    has_surface_ = true;
    for (Slot slot = 0; slot < agreed.capacity(); ++slot) {
      if (agreed.alive()[slot] == 0) continue;
      const double radius = radii[agreed.type()[slot]] * unit;
      const double off = std::sqrt(distance_squared(bodies, slot, shown)) +
                         radius * turned_off(agreed.quaternion(slot), bodies, slot);
      surface_.add_squared(off * off);
    }
  }
  void fill(BandwidthRow& row) const {
    row.max_error = centre_.max();
    row.rms_error = centre_.rms();
    if (!has_surface_) return;
    row.max_surface_error = surface_.max();
    row.rms_surface_error = surface_.rms();
  }

 private:
  template <class Shown>
  static double distance_squared(const engine::Bodies& bodies, std::size_t body, const Shown& shown) {
    double squared = 0;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const double off = shown(channel, body) - double{bodies.position[channel][body]};
      squared += off * off;
    }
    return squared;
  }
  /// 2 sin(a / 2); neither norm nor sign of a quaternion matters.
  static double turned_off(const Quaternion& q, const engine::Bodies& bodies, std::size_t body) {
    double product = 0, ours = 0, theirs = 0;
    for (std::size_t i = 0; i < q.size(); ++i) {
      const double a = q[i], b = double{bodies.orientation[i][body]};
      product += a * b;
      ours += a * a;
      theirs += b * b;
    }
    return 2 * std::sqrt(std::max(0.0, 1 - product * product / (ours * theirs)));
  }

  Lengths centre_, surface_;
  bool has_surface_ = false;
};

/// The jumps of bodies by corrections: what is visible if a client's state is shown as it is.
class Snaps {
 public:
  /// The state of the frame before its delta.
  void before(const State& predicted) {
    for (std::size_t i = 0; i < kPositionChannels; ++i)
      before_[i].assign(predicted.p(i).begin(), predicted.p(i).end());
  }
  /// Call after the correction. `renewed`: bodies that are new or jumped, which is no correction.
  void after(const State& agreed, std::span<const Slot> touched, std::span<const LifecycleRecord> renewed) {
    for (const Slot slot : touched) {
      if (std::ranges::any_of(renewed, [slot](const auto& record) { return record.slot == slot; })) continue;
      snaps_.add_squared(
          static_cast<double>(distance_squared({before_[0][slot], before_[1][slot], before_[2][slot]},
                                               {agreed.p(0)[slot], agreed.p(1)[slot], agreed.p(2)[slot]})));
    }
  }
  void fill(BandwidthRow& row, double unit) const {
    row.max_snap = snaps_.max() * unit;
    row.rms_snap = snaps_.rms() * unit;
  }

 private:
  std::array<std::vector<std::int32_t>, kPositionChannels> before_;
  Lengths snaps_;
};

/// Counts the bits of adaptive codecs' decisions, and the minimum that they could have taken.
class CodeAccount final : public EncodeObserver {
 public:
  void decided(std::span<const std::uint16_t> p1,
               std::span<const std::array<std::uint32_t, 2>> seen) override {
    decisions_.resize(seen.size());
    for (std::size_t context = 0; context < seen.size(); ++context) {
      const auto [zeros, ones] = seen[context];
      if (zeros + ones == 0) continue;
      const double p = p1[context] / 65536.0;
      ideal_bits_ -= zeros * std::log2(1 - p) + ones * std::log2(p);
      decisions_[context][0] += zeros;
      decisions_[context][1] += ones;
    }
  }
  void fill(BandwidthRow& row, double duration_s) const {
    if (decisions_.empty()) return;
    row.ideal_mbit_per_s = ideal_bits_ / (duration_s * kBitsPerMbit);
    row.bound_mbit_per_s = least_bits() / (duration_s * kBitsPerMbit);
  }

 private:
  /// The bits of all decisions at the best fixed probability of each context.
  [[nodiscard]] double least_bits() const {
    double bits = 0;
    for (const auto& [zeros, ones] : decisions_) {
      const auto all = static_cast<double>(zeros + ones);
      for (const std::uint64_t some : {zeros, ones}) {
        if (some != 0) bits += static_cast<double>(some) * std::log2(all / static_cast<double>(some));
      }
    }
    return bits;
  }

  double ideal_bits_ = 0;
  std::vector<std::array<std::uint64_t, 2>> decisions_;
};

/// A stream with a client of its own, and their measurements.
struct Lane {
  Lane(host::Mirror bodies, host::Stream server_side, ClientTimeline client_side)
      : mirror(std::move(bodies)), stream(std::move(server_side)), client(std::move(client_side)) {}

  host::Mirror mirror;
  host::Stream stream;
  ClientTimeline client;
  CodeAccount account;
  std::vector<std::uint32_t> bytes;
  Wire wire{stream.config().layout.capacity, stream.config().lattice.dt_s};
  std::uint64_t corrected = 0, at_rest = 0;
  Errors errors;
  Snaps snaps;
  DurationHistogram predict, encode, decode, apply;
};

Result<Lane> make_lane(host::StreamConfig config, const Replay& replay) {
  auto client = ClientTimeline::create(config.layout, {.run_blocks = config.local.run_blocks});
  if (!client) return tl::unexpected(client.error());
  const engine::Simulation& simulation = replay.simulation();
  auto mirror = host::make_mirror({&config, 1}, simulation.bodies());
  if (!mirror) return tl::unexpected(mirror.error());
  auto stream = host::Stream::create(std::move(config), {.mirror = *mirror,
                                                         .drive = replay.start_drive(),
                                                         .epoch = kEpoch,
                                                         .frame_rate_hz = 1 / simulation.dt_s()});
  if (!stream) return tl::unexpected(stream.error());
  stream->set_clock(&steady_ns);
  client->set_clock(&steady_ns);
  std::vector<std::byte> snapshot;
  stream->snapshot(snapshot);
  if (auto loaded = client->load(snapshot, kEpoch); !loaded) return tl::unexpected(loaded.error());
  return Lane(std::move(*mirror), std::move(*stream), std::move(*client));
}

/// One frame of one stream: the server's half, then the client's.
Result<void> advance(Lane& lane, const Replay& replay) {
  for (const ScheduledDrive& input : replay.scheduled()) {
    auto scheduled = lane.stream.schedule(input).and_then([&] { return lane.client.schedule(input); });
    if (!scheduled) return scheduled;
  }
  const engine::Simulation& simulation = replay.simulation();
  const std::int64_t began_ns = steady_ns();
  lane.mirror.update(simulation.bodies(), simulation.events());
  const std::int64_t mirror_ns = steady_ns() - began_ns;
  const host::Stream::FrameResult frame = lane.stream.produce(lane.mirror, &lane.account);
  lane.predict.add(frame.predict_ns);
  lane.encode.add(mirror_ns + frame.encode_ns);
  lane.bytes.push_back(static_cast<std::uint32_t>(frame.payload.size()));
  lane.wire.add(frame);
  lane.corrected += frame.corrected;
  lane.at_rest += lane.stream.agreed().rest_count();

  lane.client.step(1);
  lane.snaps.before(lane.client.state(frame.frame));
  auto applied = lane.client.apply(frame.frame, frame.last_input, frame.hash, frame.payload);
  const ClientTimeline::Timings timings = lane.client.timings();
  lane.decode.add(timings.decode_ns);
  lane.apply.add(timings.hash_ns + timings.predict_ns);
  if (!applied) return applied;
  const State& agreed = lane.client.state(frame.frame);
  lane.snaps.after(agreed, lane.client.touched(), frame.lifecycle);
  const host::StreamConfig& config = lane.stream.config();
  lane.errors.add(agreed, simulation.bodies(), config.lattice.unit, config.layout.radii);
  return {};
}

/// The size of the snapshot that a joiner would get after the last frame. It is cut one frame later, which is
/// rounded for it; in that frame, bodies move on.
std::size_t snapshot_bytes(host::Mirror& mirror, host::Stream& stream, const engine::Bodies& last) {
  std::array<std::vector<float>, 3> position;
  engine::Bodies bodies = last;
  for (std::size_t axis = 0; axis < position.size(); ++axis) {
    position[axis].resize(last.alive.size());
    std::transform(last.position[axis].begin(), last.position[axis].end(), last.velocity[axis].begin(),
                   position[axis].begin(), [&](float p, float v) {
                     return p + v * static_cast<float>(stream.config().lattice.dt_s);
                   });
    bodies.position[axis] = position[axis];
  }
  stream.round_next();
  mirror.update(bodies, {});
  stream.produce(mirror);
  std::vector<std::byte> snapshot;
  stream.snapshot(snapshot);
  return snapshot.size();
}

/// The row that a lane measured over `frames` frames, the last of which left `bodies`.
BandwidthRow row_of(Lane& lane, double frames, const engine::Bodies& bodies) {
  const host::StreamConfig& stream = lane.stream.config();
  BandwidthRow row;
  row.codec = stream.layout.codec;
  row.traits = *codec_traits(stream.layout.codec);
  row.predictor = stream.layout.predictor;
  row.parameters = lane.stream.parameters();
  row.mbit_per_s = mbit_per_s(lane.bytes, stream.lattice.dt_s);
  row.wire_mbit_per_s = lane.wire.mbit_per_s();
  row.bytes = std::move(lane.bytes);
  lane.account.fill(row, frames * stream.lattice.dt_s);
  lane.errors.fill(row);
  lane.snaps.fill(row, stream.lattice.unit);
  row.corrected_per_frame = static_cast<double>(lane.corrected) / frames;
  row.at_rest_per_frame = static_cast<double>(lane.at_rest) / frames;
  row.snapshot_bytes_per_body = static_cast<double>(snapshot_bytes(lane.mirror, lane.stream, bodies)) /
                                std::max(1U, lane.stream.agreed().alive_count());
  row.predict_ms = lane.predict.quantile_ms(0.5);
  row.encode_ms = lane.encode.quantile_ms(0.5);
  row.decode_ms = lane.decode.quantile_ms(0.5);
  row.apply_ms = lane.apply.quantile_ms(0.5);
  return row;
}

/// A peer and its measurements.
struct PeerLane {
  const PeerKind* kind = nullptr;
  std::unique_ptr<Peer> peer;
  std::array<std::vector<double>, 3> seen;
  std::vector<std::uint32_t> bytes;
  Errors errors;
};

Result<std::size_t> send(PeerLane& lane, const engine::Bodies& bodies) {
  auto size = lane.peer->send(bodies, lane.seen);
  if (!size) return fail(size.error().code, fmt::format("{}: {}", lane.kind->name, size.error().message));
  return size;
}

/// The start state costs no bytes, as a session's snapshot is not counted either.
Result<std::vector<PeerLane>> make_peers(const PeerSetting& setting, const engine::Bodies& start) {
  std::vector<PeerLane> lanes;
  for (const PeerKind& kind : peer_kinds()) {
    PeerLane& lane = lanes.emplace_back();
    lane.kind = &kind;
    if (kind.make == nullptr) continue;
    lane.peer = kind.make(setting);
    for (auto& column : lane.seen) column.resize(setting.bodies);
    if (auto sent = send(lane, start); !sent) return tl::unexpected(sent.error());
  }
  return lanes;
}

Result<void> advance(PeerLane& lane, const engine::Bodies& bodies) {
  if (!lane.peer) return {};
  return send(lane, bodies).map([&](std::size_t size) {
    lane.bytes.push_back(static_cast<std::uint32_t>(size));
    lane.errors.add(bodies.alive, bodies,
                    [&](std::size_t channel, std::size_t body) { return lane.seen[channel][body]; });
  });
}

BandwidthRow row_of(PeerLane& lane, double dt_s) {
  BandwidthRow row;
  row.codec = lane.kind->name;
  if (!lane.peer) {
    row.missing = lane.kind->missing;
    return row;
  }
  row.mbit_per_s = mbit_per_s(lane.bytes, dt_s);
  row.wire_mbit_per_s = Wire::mbit_per_s(lane.bytes, dt_s);
  row.bytes = std::move(lane.bytes);
  lane.errors.fill(row);
  return row;
}

}  // namespace

Result<std::vector<BandwidthRow>> measure_bandwidth(Replay& replay,
                                                    std::span<const host::StreamConfig> streams,
                                                    std::uint64_t frames,
                                                    const std::function<void(Frame)>& progress,
                                                    std::optional<double> peer_threshold) {
  const double dt_s = replay.simulation().dt_s();
  std::vector<Lane> lanes;
  lanes.reserve(streams.size());
  for (const host::StreamConfig& stream : streams) {
    auto lane = make_lane(stream, replay);
    if (!lane)
      return fail(lane.error().code, fmt::format("codec {}: {}", stream.layout.codec, lane.error().message));
    lanes.push_back(std::move(*lane));
  }
  std::vector<PeerLane> peers;
  if (peer_threshold) {
    auto made =
        make_peers({replay.simulation().capacity(), *peer_threshold, dt_s}, replay.simulation().bodies());
    if (!made) return tl::unexpected(made.error());
    peers = std::move(*made);
  }
  DurationHistogram step;
  std::vector<std::uint32_t> colliding;
  for (Frame frame = 1; frame <= frames; ++frame) {
    if (auto stepped = replay.next(); !stepped) return tl::unexpected(stepped.error());
    step.add(replay.step_ns());
    colliding.push_back(replay.simulation().colliding());
    for (Lane& lane : lanes) {
      if (auto advanced = advance(lane, replay); !advanced) {
        return fail(advanced.error().code,
                    fmt::format("codec {}, frame {}: {}", lane.stream.config().layout.codec, frame,
                                advanced.error().message));
      }
    }
    for (PeerLane& peer : peers) {
      if (auto advanced = advance(peer, replay.simulation().bodies()); !advanced)
        return tl::unexpected(advanced.error());
    }
    progress(frame);
  }

  const double step_ms = step.quantile_ms(0.5);
  std::vector<BandwidthRow> rows;
  rows.reserve(lanes.size() + peers.size());
  for (Lane& lane : lanes)
    rows.push_back(row_of(lane, static_cast<double>(frames), replay.simulation().bodies()));
  for (PeerLane& peer : peers) rows.push_back(row_of(peer, dt_s));
  const auto contacts = std::accumulate(colliding.begin(), colliding.end(), std::uint64_t{0});
  for (BandwidthRow& row : rows) {
    row.bodies = replay.simulation().capacity();
    row.frames = frames;
    row.dt_s = dt_s;
    if (!streams.empty()) row.lattice_unit = streams.front().lattice.unit;
    row.colliding_per_frame = static_cast<double>(contacts) / static_cast<double>(frames);
    row.colliding = colliding;
    row.step_ms = step_ms;
  }
  return rows;
}

}  // namespace tandem::lab
