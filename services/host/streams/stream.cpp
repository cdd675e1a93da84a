#include "services/host/streams/stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "sdk/core/codec/lifecycle.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/predict/predictor.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/wire/limits.hpp"
#include "services/host/streams/contact_control.hpp"

namespace tandem::host {
namespace {

bool reads_shapes(const Layout& layout) {
  const auto traits = find_predictor(layout.predictor);
  return traits && (*traits)->reads_shapes;
}

Result<void> check_start(const StreamConfig& config, const StreamStart& start) {
  const auto refuse = [](std::string message) {
    return fail(ErrorCode::kInvalidArgument, std::move(message));
  };
  if (config.quality) {
    if (!(config.quality->target_mbit_per_s >= 0))
      return refuse(fmt::format("the target must be 0 (none) or more, not {} Mbit/s",
                                config.quality->target_mbit_per_s));
    if (!valid_goal(*config.quality, config.layout.parameters.codec))
      return refuse("automatic quality: the threshold must lie between its minimum and its maximum");
    const std::size_t least = least_budget(*config.quality, start.frame_rate_hz);
    if (config.budget < least) {
      return refuse(fmt::format(
          "a budget of {} bytes per frame is too small for a target of {} Mbit/s, which needs at least {} "
          "bytes",
          config.budget, config.quality->target_mbit_per_s, least));
    }
  }
  return {};
}

// Of a session with so many slots that a delta cannot hold all that may be: the part that data may take.
constexpr std::size_t kMaxDataShare = transport::kMaxDeltaBytes / 4;

// The part of a mirror's state that a stream with these groups sends; the mirror may have orientations in
// addition.
State told(const State& shown, const Groups& groups) {
  if (shown.groups() == groups) return shown;
  State state(shown.capacity(), groups);
  for (Slot slot = 0; slot < shown.capacity(); ++slot) {
    if (shown.alive()[slot] != 0)
      state.spawn(slot, shown.reuse()[slot], shown.type()[slot], shown.body(slot));
  }
  return state;
}

// Puts slow bodies of these slots to rest, so that a snapshot cut soon after needs few bytes for a heap of
// resting bodies. A body at the top of its throw is slow too; it is then corrected once more.
void put_slow_to_rest(State& state, const Drive& drive, std::int32_t threshold, Slot first, Slot end) {
  // A speed that exceeds the threshold after so many frames, in 1/64 lattice unit per frame.
  constexpr std::int64_t kFrames = 30;
  const auto slow = [&](Slot slot) {
    for (std::size_t axis = 0; axis < kPositionChannels; ++axis) {
      if (std::abs(std::int64_t{state.v(axis)[slot]}) * kFrames > std::int64_t{threshold} * 64) return false;
    }
    return state.groups() == Groups{} || state.body(slot).w == Spin{};
  };
  for (Slot slot = first; slot < end; ++slot) {
    if (state.alive()[slot] == 0 || !slow(slot)) continue;
    state.rest()[slot] = 1;
    for (std::size_t axis = 0; axis < kPositionChannels; ++axis) {
      state.v(axis)[slot] = 0;
      state.c(axis)[slot] = -drive.gravity[axis];
    }
  }
}

// In a heap that stands before the session begins, a predicted step that computes contacts may hold every
// body within the threshold for ever, so that no correction puts it to rest, and compute all of them in every
// frame. With few bodies that takes little time, and is worth it: a body that is struck later moves without a
// correction only if it is not at rest.
void put_slow_to_rest(State& state, const StreamStart& start, const Predictor& predictor,
                      std::int32_t threshold) {
  constexpr std::uint32_t kMany = 65'536;
  if (start.under_way) return put_slow_to_rest(state, start.drive, threshold, 0, state.capacity());
  if (predictor.interacts() && state.alive_count() < kMany) return;
  const Slot capacity = state.capacity();
  for (std::size_t block = 0; block < start.moved.size(); ++block) {
    const auto first = static_cast<Slot>(block * engine::kMovedSlots);
    if (start.moved[block] == 0 && first < capacity)
      put_slow_to_rest(state, start.drive, threshold, first, std::min(first + engine::kMovedSlots, capacity));
  }
}

// A session may begin without bodies. The cost of bodies is then measured with these, which are far from each
// other.
State spread_bodies(const Layout& layout) {
  constexpr Slot kMaxSlots = 4096, kSide = 16;
  constexpr std::int32_t kApart = 4096;
  State state(std::min(layout.capacity, kMaxSlots), groups_of(layout));
  for (Slot slot = 0; slot < state.capacity(); ++slot) {
    const Vec3i place{static_cast<std::int32_t>(slot % kSide) * kApart,
                      static_cast<std::int32_t>(slot / kSide % kSide) * kApart,
                      static_cast<std::int32_t>(slot / (kSide * kSide)) * kApart};
    state.spawn(slot, 0, 0, {.p = place});
  }
  return state;
}

}  // namespace

struct Stream::Impl final : EncodeObserver {
  Impl(StreamConfig configuration, const StreamStart& start, ServerTimeline server)
      : config(std::move(configuration)),
        timeline(std::move(server)),
        parameters(config.layout.parameters),
        drive(start.drive) {
    State state = told(start.mirror.target(), groups_of(config.layout));
    if (codec_traits(config.layout.codec)->reads_gains)
      put_slow_to_rest(state, start, timeline.predictor(), parameters.codec.threshold);
    timeline.start(start.frame, state, start.drive, start.last_input, start.pending, start.world,
                   config.layout.data.empty() ? std::span<const std::byte>() : start.mirror.data());
    if (config.data_kbit_s > 0) data_bytes_a_frame = config.data_kbit_s * 1000 / 8 / start.frame_rate_hz;
    bodies = state.alive_count();
    if (config.quality) {
      quality.emplace(*config.quality, step_rule(*codec_traits(config.layout.codec)), parameters.codec,
                      config.layout.capacity, start.frame_rate_hz, config.layout.radii);
    }
    if (config.gains) gains.emplace(*config.gains, config.layout.capacity, parameters);
    if (config.gains && parameters.step.contacts.listed) {
      contacts.emplace(config.layout.capacity, parameters, reads_shapes(config.layout));
      timeline.watch_pushes();
    }
  }

  // Passes on what the encoder tells to the parts that need it.
  void frame(const State& predicted, const State& target, const CodecParameters& in_force) override {
    if (quality) quality->observe(predicted, target, in_force);
    if (contacts) contacts->observe(predicted, target, in_force.threshold, timeline.predictor().pushes());
    if (other != nullptr) other->frame(predicted, target, in_force);
  }
  void decided(std::span<const std::uint16_t> p1,
               std::span<const std::array<std::uint32_t, 2>> seen) override {
    if (other != nullptr) other->decided(p1, seen);
  }
  void steered(const GainEvidence& evidence) override {
    if (gains) gains->observe(evidence);
    if (other != nullptr) other->steered(evidence);
  }

  void choose_parameters(const FrameResult& result, const FrameBudget& room);
  std::span<const LifecycleRecord> records_of(const Mirror& mirror);
  [[nodiscard]] std::size_t room_for_corrections(std::size_t record_count) const;
  /// Bytes of the next frame's section of data.
  std::size_t room_for_data();

  StreamConfig config;
  ServerTimeline timeline;
  StreamParameters parameters;  // of the next frame
  Drive drive;                  // drive at the start
  std::optional<QualityControl> quality;
  std::optional<GainControl> gains;
  std::optional<ContactControl> contacts;
  std::vector<LifecycleRecord> records;  // of the current frame, if the mirror's records name other groups
  EncodeObserver* other = nullptr;       // of the current frame
  std::uint32_t bodies = 0;
  double data_bytes_a_frame = 0;  // 0: no limit
  double data_room = 0;           // bytes, of what the rate permits
  std::int64_t (*clock)() = nullptr;
};

bool same_encoding(const StreamConfig& a, const StreamConfig& b) {
  return a.layout == b.layout && a.budget == b.budget && a.data_kbit_s == b.data_kbit_s &&
         a.quality == b.quality && a.gains == b.gains && a.cap_kbit_s == b.cap_kbit_s;
}

std::uint32_t encoding_offer(std::span<const StreamConfig> offers, std::size_t offer) {
  TANDEM_ASSERT(offer < offers.size());
  const auto first = std::ranges::find(offers, offers[offer].name, &StreamConfig::name);
  return static_cast<std::uint32_t>(first - offers.begin());
}

std::uint32_t encoding_offers(std::span<const StreamConfig> offers) {
  std::uint32_t count = 0;
  while (count < offers.size() && encoding_offer(offers, count) == count) ++count;
  return count;
}

namespace {

tl::unexpected<Error> refuse_offer(std::string message) {
  return fail(ErrorCode::kInvalidArgument, std::move(message));
}

Result<void> check_name(const std::string& name) {
  constexpr std::array<std::string_view, 4> kPreferences{"auto", "bandwidth", "computing", "error"};
  if (!transport::is_stream_name(name)) {
    return refuse_offer(
        fmt::format("a stream's name has 1 to {} characters of a-z, 0-9, '_' and '-', unlike '{}'",
                    transport::kMaxStreamNameBytes, name));
  }
  if (std::ranges::find(kPreferences, name) == kPreferences.end()) return {};
  return refuse_offer(
      fmt::format("a stream cannot be called '{}', which clients use as the name of a preference", name));
}

}  // namespace

Result<void> check_stream_names(std::span<const StreamConfig> offers) {
  if (offers.empty() || offers.size() > transport::kMaxStreams)
    return refuse_offer(
        fmt::format("a session has 1 to {} streams, not {}", transport::kMaxStreams, offers.size()));
  const auto has_name_of_first = [&](const StreamConfig& one) { return one.name == offers.front().name; };
  const bool needs_names = !offers.front().name.empty() || !std::ranges::all_of(offers, has_name_of_first);
  for (std::size_t i = 0; i < offers.size(); ++i) {
    const StreamConfig& offer = offers[i];
    if (needs_names)
      if (auto good = check_name(offer.name); !good) return good;
    std::size_t delays = 1;
    for (const StreamConfig& other : offers.first(i)) {
      if (other.name != offer.name) continue;
      if (other.delay_ms == offer.delay_ms || !same_encoding(other, offer))
        return refuse_offer(
            fmt::format("two streams are called '{}': every stream needs a name of its own", offer.name));
      ++delays;
    }
    if (delays > kMaxDelays)
      return refuse_offer(
          fmt::format("stream '{}' is offered in more than {} delays", offer.name, kMaxDelays));
  }
  return {};
}

Result<void> choose_gains(StreamConfig& config) {
  const std::string_view name = config.local.encodes_as;
  const auto traits = find_predictor(name.empty() ? config.layout.predictor : name);
  if (!traits) return tl::unexpected(traits.error());
  set_first_gains(**traits, config.layout.parameters);
  config.gains = usual_gain_goal(**traits);
  return {};
}

Result<Mirror> make_mirror(std::span<const StreamConfig> streams, const engine::Bodies& bodies,
                           double extent) {
  const StreamConfig& first = streams.front();
  Groups groups;
  std::size_t record_bytes = 0;
  for (const StreamConfig& stream : streams) {
    if (stream.lattice != first.lattice || stream.layout.capacity != first.layout.capacity ||
        stream.layout.type_count != first.layout.type_count)
      return fail(ErrorCode::kInvalidArgument,
                  "all streams of a session need the same lattice, capacity and number of types");
    groups.orientation |= groups_of(stream.layout).orientation;
    record_bytes = std::max(record_bytes, data_record_bytes(stream.layout.data));
  }
  if (groups.orientation && bodies.orientation[0].empty()) {
    return fail(ErrorCode::kInvalidArgument,
                "the stream has orientations, which the simulation's bodies do not have");
  }
  Mirror mirror(first.lattice, first.layout.capacity, first.layout.type_count, groups, extent);
  mirror.carry_data(record_bytes);
  if (auto good = mirror.check(bodies); !good) return tl::unexpected(good.error());
  mirror.start(bodies);
  return mirror;
}

Result<std::size_t> largest_delta_bytes(std::span<const StreamConfig> streams) {
  std::size_t largest = 0;
  for (const StreamConfig& stream : streams) {
    const auto timeline = ServerTimeline::create(stream.layout, Epoch{1});
    if (!timeline && stream.name.empty()) return tl::unexpected(timeline.error());
    if (!timeline) {
      return fail(timeline.error().code, fmt::format("stream {}: {}", stream.name, timeline.error().message));
    }
    largest = std::max(largest, std::min<std::size_t>(timeline->payload_bound(), transport::kMaxDeltaBytes));
  }
  return largest;
}

Result<Stream> Stream::create(StreamConfig config, const StreamStart& start) {
  if (auto good = check_start(config, start); !good) return tl::unexpected(good.error());
  auto timeline = ServerTimeline::create(config.layout, start.epoch, config.local, start.id);
  if (!timeline) return tl::unexpected(timeline.error());
  return Stream(std::make_unique<Impl>(std::move(config), start, std::move(*timeline)));
}

Stream::Stream(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Stream::Stream(Stream&&) noexcept = default;
Stream& Stream::operator=(Stream&&) noexcept = default;
Stream::~Stream() = default;

std::span<const LifecycleRecord> Stream::Impl::records_of(const Mirror& mirror) {
  const Groups groups = groups_of(config.layout);
  if (mirror.target().groups() == groups) return mirror.lifecycle();
  records.assign(mirror.lifecycle().begin(), mirror.lifecycle().end());
  for (LifecycleRecord& record : records) record.groups &= bits_of(groups);
  return records;
}

// With millions of slots, the largest payload that could be is more than a session may declare.
std::size_t Stream::Impl::room_for_corrections(std::size_t record_count) const {
  if (timeline.payload_bound() <= transport::kMaxDeltaBytes) return kNoBudget;
  constexpr std::size_t kHeaderBytes = 4096;  // of sections, and parameters
  const std::size_t others = kHeaderBytes + (config.layout.world.any() ? kMaxNewsBytes : 0) +
                             (config.layout.data.empty() ? 0 : kMaxDataShare) +
                             record_count * most_lifecycle_bytes_per_slot(groups_of(config.layout));
  return transport::kMaxDeltaBytes - std::min<std::size_t>(others, transport::kMaxDeltaBytes);
}

std::size_t Stream::Impl::room_for_data() {
  const std::size_t most = timeline.payload_bound() <= transport::kMaxDeltaBytes ? SIZE_MAX : kMaxDataShare;
  if (data_bytes_a_frame <= 0) return most;
  // What was not used is saved up for a frame, so that motion is not held up by much.
  constexpr double kLeastBytes = 64;
  data_room = std::min(data_room + data_bytes_a_frame, std::max(2 * data_bytes_a_frame, kLeastBytes));
  return std::min(most, static_cast<std::size_t>(std::max(0.0, data_room - kMaxSectionHeaderBytes)));
}

Stream::FrameResult Stream::produce(const Mirror& mirror, EncodeObserver* observer,
                                    std::span<const std::byte> news, const FrameBudget& room) {
  Impl& m = *impl_;
  const std::span<const LifecycleRecord> records = m.records_of(mirror);
  for (const LifecycleRecord& record : records) {
    if (record.kind == LifecycleKind::kSpawn) ++m.bodies;
    TANDEM_ASSERT(record.kind != LifecycleKind::kDespawn || m.bodies > 0);
    if (record.kind == LifecycleKind::kDespawn) --m.bodies;
  }
  TANDEM_ASSERT(m.bodies <= m.config.layout.capacity);
  m.other = observer;
  EncodeObserver* const listener = m.quality || m.gains || m.contacts ? &m : observer;
  const std::size_t budget = std::min({m.config.budget, room.most, m.room_for_corrections(records.size())});
  DataTarget data;
  if (!m.config.layout.data.empty()) data = {mirror.data(), m.room_for_data()};
  const FrameResult result{
      m.timeline.advance(mirror.target(), records, budget, listener, mirror.numbers(), news, data), records};
  m.data_room -= static_cast<double>(result.data_bytes);
  m.choose_parameters(result, room);
  return result;
}

void Stream::Impl::choose_parameters(const FrameResult& result, const FrameBudget& room) {
  const bool coarser =
      quality && quality->after_frame(result.payload.size(), result.corrected, parameters.codec, room);
  const bool steered = gains && gains->after_frame(parameters);
  const bool learned = contacts && contacts->after_frame(parameters);
  if (coarser || steered || learned) timeline.set_parameters(parameters);
}

Result<void> Stream::set_parameters(const StreamParameters& parameters) {
  if (!valid_parameters(parameters.codec) || !list_the_same(parameters, impl_->parameters))
    return fail(ErrorCode::kInvalidArgument, "parameters out of range");
  if (impl_->quality) return fail(ErrorCode::kInvalidArgument, "automatic quality decides the parameters");
  impl_->parameters = parameters;
  impl_->timeline.set_parameters(parameters);
  return {};
}

void Stream::resume(const StreamParameters& learned) {
  Impl& m = *impl_;
  StreamParameters parameters = m.parameters;
  if (m.quality) {
    CodecParameters codec = learned.codec;
    codec.threshold = std::clamp(codec.threshold, m.config.quality->smallest_threshold,
                                 m.config.quality->largest_threshold);
    codec.velocity_gain = parameters.codec.velocity_gain;
    codec.acceleration_gain = parameters.codec.acceleration_gain;
    if (has_turn_steps(codec) == has_turn_steps(parameters.codec)) parameters.codec = codec;
  }
  if (m.gains) {
    parameters.step.decay = learned.step.decay;
    parameters.codec.velocity_gain = learned.codec.velocity_gain;
    parameters.codec.acceleration_gain = learned.codec.acceleration_gain;
    m.gains.emplace(*m.config.gains, m.config.layout.capacity, parameters);
  }
  if (m.contacts && learned.step.contacts.listed) {
    parameters.step.contacts = learned.step.contacts;
    m.contacts.emplace(m.config.layout.capacity, parameters, reads_shapes(m.config.layout));
  }
  if (parameters == m.parameters) return;
  m.parameters = parameters;
  m.timeline.set_parameters(parameters);
}

void Stream::set_clock(std::int64_t (*now_ns)()) {
  impl_->clock = now_ns;
  impl_->timeline.set_clock(now_ns);
}

std::uint32_t Stream::measure_client_cost() const {
  const Impl& m = *impl_;
  const Layout& layout = m.config.layout;
  State from = m.bodies == 0 ? spread_bodies(layout) : agreed();
  const auto predictor = make_predictor(layout.predictor, from.capacity(), layout.predictor_constants);
  if (m.clock == nullptr || !predictor) return 0;
  from.keep_for_predictor((*predictor)->own_bytes());
  const StepInput input{m.drive, m.parameters.step, m.parameters.codec.threshold, m.drive.gravity};
  State to = from;
  StateHasher hasher;
  std::array<std::int64_t, 9> took_ns{};
  for (std::int64_t& took : took_ns) {
    const std::int64_t began_ns = m.clock();
    (*predictor)->step(from, to, input);
    static_cast<void>(hasher.hash(to));
    took = m.clock() - began_ns;
  }
  std::ranges::nth_element(took_ns, took_ns.begin() + took_ns.size() / 2);
  const std::int64_t bodies = from.alive_count();
  TANDEM_ASSERT(bodies > 0);
  return static_cast<std::uint32_t>(
      std::max<std::int64_t>((took_ns[took_ns.size() / 2] + bodies - 1) / bodies, 1));
}

Result<void> Stream::schedule(const ScheduledDrive& input) { return impl_->timeline.schedule(input); }
void Stream::round_next() {
  if (codec_traits(impl_->config.layout.codec)->keeps_rounding) impl_->timeline.round_next();
}
void Stream::snapshot(std::vector<std::byte>& out, std::optional<StreamId> as) {
  impl_->timeline.snapshot(out, as);
}
const StreamParameters& Stream::parameters() const { return impl_->parameters; }
double Stream::threshold_m() const { return impl_->parameters.codec.threshold * impl_->config.lattice.unit; }
bool Stream::target_out_of_reach() const { return impl_->quality && impl_->quality->out_of_reach(); }
const StreamConfig& Stream::config() const { return impl_->config; }
Frame Stream::frame() const { return impl_->timeline.frame(); }
const State& Stream::agreed() const { return impl_->timeline.state(); }
std::uint64_t Stream::hash() const { return impl_->timeline.hash(); }
std::uint64_t Stream::last_input() const { return impl_->timeline.last_input(); }
std::uint32_t Stream::bodies() const { return impl_->bodies; }
std::uint32_t Stream::crowded() const { return impl_->timeline.predictor().crowded(); }
std::size_t Stream::payload_bound() const {
  return std::min<std::size_t>(impl_->timeline.payload_bound(), transport::kMaxDeltaBytes);
}
std::size_t Stream::snapshot_bound() const {
  return std::min<std::size_t>(impl_->timeline.snapshot_bound(), transport::kMaxSnapshotBytes);
}

}  // namespace tandem::host
