#include "services/host/stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/predict/predictor.hpp"
#include "services/host/mirror.hpp"

namespace tandem::host {
namespace {

Result<void> check_columns(const Layout& layout, const engine::Bodies& bodies) {
  const std::size_t capacity = layout.capacity;
  bool whole = bodies.alive.size() == capacity && bodies.type.size() == capacity;
  const auto look_at = [&](const auto& columns) {
    for (const auto& column : columns) whole = whole && column.size() == capacity;
  };
  look_at(bodies.position);
  look_at(bodies.velocity);
  if (groups_of(layout).orientation) {
    look_at(bodies.orientation);
    look_at(bodies.angular_velocity);
  }
  if (whole) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("the simulation has body columns that are not of {} slots", capacity));
}

Result<void> check(const StreamConfig& config, const StreamStart& start) {
  const auto refuse = [](std::string message) {
    return fail(ErrorCode::kInvalidArgument, std::move(message));
  };
  if (config.quality) {
    if (!valid_goal(*config.quality, config.layout.parameters.codec))
      return refuse("automatic quality: the threshold must lie between its smallest and its largest");
    const std::size_t least = least_budget(*config.quality, start.frame_rate_hz);
    if (config.budget < least) {
      return refuse(fmt::format(
          "a budget of {} bytes a frame is too tight for a target of {} Mbit/s, which needs at least {} bytes",
          config.budget, config.quality->target_mbit_per_s, least));
    }
  }
  if (groups_of(config.layout).orientation && start.bodies.orientation[0].empty())
    return refuse("the stream has orientations, which the simulation's bodies do not have");
  return check_columns(config.layout, start.bodies);
}

}  // namespace

struct Stream::Impl final : EncodeObserver {
  Impl(StreamConfig configuration, const StreamStart& start, ServerTimeline server)
      : config(std::move(configuration)),
        mirror(config.lattice, config.layout.capacity, config.layout.type_count, groups_of(config.layout)),
        timeline(std::move(server)),
        parameters(config.layout.parameters),
        drive(start.drive) {
    mirror.start(start.bodies);
    timeline.start(start.frame, mirror.target(), start.drive);
    bodies = mirror.target().alive_count();
    if (config.quality) {
      quality.emplace(*config.quality, step_rule(*codec_traits(config.layout.codec)), parameters.codec,
                      config.layout.capacity, start.frame_rate_hz, config.layout.radii);
    }
    if (config.gains) gains.emplace(*config.gains, config.layout.capacity, parameters);
  }

  // What the encoder tells goes to whom it concerns.
  void frame(const State& predicted, const State& target, const CodecParameters& in_force) override {
    if (quality) quality->observe(predicted, target, in_force);
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

  void choose_parameters(const FrameResult& result);
  [[nodiscard]] std::int64_t now_ns() const { return clock == nullptr ? 0 : clock(); }

  StreamConfig config;
  Mirror mirror;
  ServerTimeline timeline;
  StreamParameters parameters;  // of the next frame
  Drive drive;                  // of the start
  std::optional<QualityControl> quality;
  std::optional<GainControl> gains;
  EncodeObserver* other = nullptr;  // of the frame at hand
  std::uint32_t bodies = 0;
  std::int64_t (*clock)() = nullptr;
};

Result<void> choose_gains(StreamConfig& config) {
  // What the constants make of the predictor, which may be another than the name says.
  const auto predictor = make_predictor(config.layout.predictor, 1, config.layout.predictor_constants);
  if (!predictor) return tl::unexpected(predictor.error());
  const std::string_view kind = (*predictor)->name();
  set_first_gains(kind, config.layout.parameters);
  config.gains = usual_gain_goal(kind);
  return {};
}

Result<std::size_t> largest_delta_bytes(const StreamConfig& config) {
  return ServerTimeline::create(config.layout, Epoch{1}).map([](const ServerTimeline& timeline) {
    return timeline.payload_bound();
  });
}

Result<Stream> Stream::create(StreamConfig config, const StreamStart& start) {
  if (auto good = host::check(config, start); !good) return tl::unexpected(good.error());
  auto timeline = ServerTimeline::create(config.layout, start.epoch, config.local);
  if (!timeline) return tl::unexpected(timeline.error());
  return Stream(std::make_unique<Impl>(std::move(config), start, std::move(*timeline)));
}

Stream::Stream(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Stream::Stream(Stream&&) noexcept = default;
Stream& Stream::operator=(Stream&&) noexcept = default;
Stream::~Stream() = default;

Result<void> Stream::check(const engine::Bodies& bodies) const {
  return check_columns(impl_->config.layout, bodies);
}

Stream::FrameResult Stream::produce(const engine::Bodies& bodies, std::span<const engine::Event> events,
                                    EncodeObserver* observer) {
  Impl& m = *impl_;
  const std::int64_t began_ns = m.now_ns();
  m.mirror.update(bodies, events);
  const std::int64_t mirrored_ns = m.now_ns();
  for (const LifecycleRecord& record : m.mirror.lifecycle()) {
    if (record.kind == LifecycleKind::kSpawn) ++m.bodies;
    if (record.kind == LifecycleKind::kDespawn) --m.bodies;
  }
  m.other = observer;
  EncodeObserver* const listener = m.quality || m.gains ? &m : observer;
  const FrameResult result{
      m.timeline.advance(m.mirror.target(), m.mirror.lifecycle(), m.config.budget, listener),
      m.mirror.lifecycle(), mirrored_ns - began_ns};
  m.choose_parameters(result);
  return result;
}

void Stream::Impl::choose_parameters(const FrameResult& result) {
  const bool coarser =
      quality && quality->after_frame(result.payload.size(), result.corrected, parameters.codec);
  const bool steered = gains && gains->after_frame(parameters);
  if (coarser || steered) timeline.set_parameters(parameters);
}

Result<void> Stream::set_parameters(const StreamParameters& parameters) {
  if (!valid_parameters(parameters.codec) ||
      has_turn_steps(parameters.codec) != has_turn_steps(impl_->parameters.codec))
    return fail(ErrorCode::kInvalidArgument, "parameters out of range");
  if (impl_->quality) return fail(ErrorCode::kInvalidArgument, "automatic quality decides the parameters");
  impl_->parameters = parameters;
  impl_->timeline.set_parameters(parameters);
  return {};
}

void Stream::set_clock(std::int64_t (*now_ns)()) {
  impl_->clock = now_ns;
  impl_->timeline.set_clock(now_ns);
}

std::uint32_t Stream::measure_client_cost() const {
  const Impl& m = *impl_;
  const State& from = agreed();
  const Layout& layout = m.config.layout;
  const auto predictor = make_predictor(layout.predictor, layout.capacity, layout.predictor_constants);
  if (m.clock == nullptr || m.bodies == 0 || !predictor) return 0;
  const StepInput input{.drive = m.drive, .parameters = m.parameters.step};
  State to(layout.capacity, groups_of(layout));
  StateHasher hasher;
  std::array<std::int64_t, 9> took_ns{};
  for (std::int64_t& took : took_ns) {
    const std::int64_t began_ns = m.clock();
    (*predictor)->step(from, to, input);
    static_cast<void>(hasher.hash(to));
    took = m.clock() - began_ns;
  }
  std::ranges::nth_element(took_ns, took_ns.begin() + took_ns.size() / 2);
  return static_cast<std::uint32_t>(took_ns[took_ns.size() / 2] / m.bodies);
}

Result<void> Stream::schedule(const ScheduledDrive& input) { return impl_->timeline.schedule(input); }
void Stream::round_next() {
  if (codec_traits(impl_->config.layout.codec)->keeps_rounding) impl_->timeline.round_next();
}
void Stream::snapshot(std::vector<std::byte>& out) { impl_->timeline.snapshot(out); }
const StreamParameters& Stream::parameters() const { return impl_->parameters; }
double Stream::threshold_m() const { return impl_->parameters.codec.threshold * impl_->config.lattice.unit; }
bool Stream::target_out_of_reach() const { return impl_->quality && impl_->quality->out_of_reach(); }
const StreamConfig& Stream::config() const { return impl_->config; }
Frame Stream::frame() const { return impl_->timeline.frame(); }
const State& Stream::agreed() const { return impl_->timeline.state(); }
std::uint64_t Stream::hash() const { return impl_->timeline.hash(); }
std::uint64_t Stream::last_input() const { return impl_->timeline.last_input(); }
engine::Mishaps Stream::mishaps() const { return impl_->mirror.mishaps(); }
std::uint32_t Stream::bodies() const { return impl_->bodies; }
std::size_t Stream::payload_bound() const { return impl_->timeline.payload_bound(); }
std::size_t Stream::snapshot_bound() const { return impl_->timeline.snapshot_bound(); }

}  // namespace tandem::host
