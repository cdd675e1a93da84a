#include "services/host/streams/mirror.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "services/host/streams/quantise.hpp"

namespace tandem::host {
namespace {

constexpr std::uint8_t mark(engine::Event::Kind kind) {
  return static_cast<std::uint8_t>(1U << static_cast<unsigned>(kind));
}
// Tolerance of a quaternion's squared norm, for single precision and an engine that seldom normalises.
constexpr double kNormSlack = 0.01;
// One below the limit, because a double cannot distinguish the limit's square from the next integers.
constexpr double kMaxSpin = kSpinLimit - 1;

constexpr std::uint8_t kSpawned = mark(engine::Event::Kind::kSpawned);
constexpr std::uint8_t kTeleported = mark(engine::Event::Kind::kTeleported);

static_assert(kBlockSlots == engine::kMovedSlots);
constexpr std::size_t kMaxReserved = 8192;  // records, of frames in which few bodies come and go

}  // namespace

/// The values of a run of slots, before they replace those of the frame before.
struct Mirror::Run {
  static constexpr std::uint32_t kSlots = 512;  // whose values stay in the innermost cache
  static_assert(kBlockSlots % kSlots == 0);
  using Column = std::array<std::int32_t, kSlots>;
  Slot first = 0;
  std::uint32_t slots = 0;
  std::array<Column, kPositionChannels> p{}, v{};
  std::array<Column, kQuaternionChannels> q{};
  std::array<Column, kSpinChannels> w{};
  Column off{};   // 1: not finite, or off the lattice
  Column told{};  // all bits: the mirror shows the body's values; none: zeros
};

Mirror::Mirror(const Lattice& lattice, std::uint32_t capacity, TypeId type_count, const Groups& groups,
               double extent)
    : lattice_(lattice),
      extent_(std::min(extent, kPositionLimit * lattice.unit)),
      type_count_(type_count),
      target_(capacity, groups),
      shown_(capacity),
      expelled_(capacity),
      marks_(capacity),
      generations_(capacity),
      blocks_(block_count(capacity)),
      numbers_(block_count(capacity), 1) {
  TANDEM_ASSERT(lattice.unit > 0 && extent_ > 0);
  lifecycle_.reserve(std::min(std::size_t{2} * capacity, kMaxReserved));
  busy_.reserve(block_count(capacity));
}

void Mirror::carry_data(std::size_t record_bytes) { data_.resize(record_bytes * shown_.size()); }

Result<void> Mirror::check(const engine::Bodies& bodies) const {
  const std::size_t capacity = shown_.size();
  std::string wrong;  // the first fault
  const auto look_at = [&](std::string_view name, std::size_t size) {
    if (wrong.empty() && size != capacity)
      wrong = fmt::format("the simulation's column {} has {} slots, not {}", name, size, capacity);
  };
  const auto look_at_axes = [&](std::string_view name, const auto& columns) {
    for (std::size_t i = 0; i < columns.size(); ++i)
      look_at(fmt::format("{}[{}]", name, i), columns[i].size());
  };
  look_at("alive", bodies.alive.size());
  look_at("type", bodies.type.size());
  look_at_axes("position", bodies.position);
  look_at_axes("velocity", bodies.velocity);
  if (target_.groups().orientation) {
    look_at_axes("orientation", bodies.orientation);
    look_at_axes("angular_velocity", bodies.angular_velocity);
  }
  if (wrong.empty() && !data_.empty() && bodies.data.size() != data_.size())
    wrong = fmt::format("the simulation's bodies have {} bytes of data, not {}", bodies.data.size(),
                        data_.size());
  if (wrong.empty()) return {};
  return fail(ErrorCode::kInvalidArgument, wrong);
}

void Mirror::quantise(const engine::Bodies& bodies, const RunBlocks& run) {
  if (!data_.empty()) std::ranges::copy(bodies.data, data_.begin());
  run_jobs(static_cast<std::uint32_t>(busy_.size()), run,
           [&](std::uint32_t i) { quantise_block(bodies, busy_[i]); });
  for (const std::uint32_t block : busy_) {
    const BlockNews& news = blocks_[block];
    if (news.changed) ++numbers_[block];
    mishaps_.clamped += news.slowed;
    if (news.slowed > 0) last_slowed_ = news.last_slowed;
  }
  hidden_ = 0;
  for (const BlockNews& news : blocks_) hidden_ += news.hidden;
}

void Mirror::quantise_block(const engine::Bodies& bodies, std::uint32_t block) {
  const double position = lattice_.position_scale();
  const double velocity = lattice_.velocity_scale();
  const auto world = static_cast<float>(extent_);
  constexpr float kFinite = std::numeric_limits<float>::max();
  BlockNews& news = blocks_[block];
  news = {};
  const Slot end = std::min(target_.capacity(), (block + 1) * kBlockSlots);
  Run run;
  for (run.first = block * kBlockSlots; run.first < end; run.first += Run::kSlots) {
    run.slots = std::min(Run::kSlots, end - run.first);
    run.off.fill(0);
    const auto off = std::span(run.off).first(run.slots);
    for (std::size_t i = 0; i < kPositionChannels; ++i) {
      quantise_column(bodies.position[i].subspan(run.first, run.slots), position, kPositionLimit, world,
                      std::span(run.p[i]).first(run.slots), off);
      quantise_column(bodies.velocity[i].subspan(run.first, run.slots), velocity, kVelocityLimit, kFinite,
                      std::span(run.v[i]).first(run.slots), off);
    }
    if (target_.groups().orientation) quantise_turns(bodies, run, news);
    const SlotNews seen = look_at_slots({.alive = bodies.alive.data() + run.first,
                                         .type = bodies.type.data() + run.first,
                                         .was_alive = target_.alive().data() + run.first,
                                         .had_type = target_.type().data() + run.first,
                                         .expelled = expelled_.data() + run.first,
                                         .marks = marks_.data() + run.first,
                                         .off = run.off.data()},
                                        run.slots, type_count_, shown_.data() + run.first, run.told.data());
    news.restless |= seen.restless;
    news.hidden += seen.hidden;
    const auto take = [&](Run::Column& values, std::span<std::int32_t> column) {
      news.changed |= replace(values.data(), run.told.data(), run.slots, column.data() + run.first);
    };
    for (std::size_t i = 0; i < kPositionChannels; ++i) {
      take(run.p[i], target_.p(i));
      take(run.v[i], target_.v(i));
    }
    if (!target_.groups().orientation) continue;
    for (std::size_t i = 0; i < kQuaternionChannels; ++i) take(run.q[i], target_.q(i));
    for (std::size_t i = 0; i < kSpinChannels; ++i) take(run.w[i], target_.w(i));
  }
}

void Mirror::quantise_turns(const engine::Bodies& bodies, Run& run, BlockNews& news) const {
  const double per_frame = std::ldexp(lattice_.dt_s, 28);
  for (std::uint32_t k = 0; k < run.slots; ++k) {
    const Slot s = run.first + k;
    if (bodies.alive[s] == 0) continue;
    std::array<double, 4> q{};
    std::array<double, 3> w{};
    double norm = 0, speed = 0;
    for (std::size_t i = 0; i < q.size(); ++i) {
      q[i] = double{bodies.orientation[i][s]};
      norm += q[i] * q[i];
    }
    for (std::size_t i = 0; i < w.size(); ++i) {
      w[i] = double{bodies.angular_velocity[i][s]} * per_frame;
      speed += w[i] * w[i];
    }
    if (!(std::abs(norm - 1) <= kNormSlack) || !std::isfinite(speed)) {
      run.off[k] = 1;
      continue;
    }
    const double unit = kQuaternionOne / std::sqrt(norm);
    const double kept = std::min(1.0, kMaxSpin / std::sqrt(std::max(speed, 1.0)));
    if (kept < 1) {
      ++news.slowed;
      news.last_slowed = s;
    }
    for (std::size_t i = 0; i < q.size(); ++i)
      run.q[i][k] = static_cast<std::int32_t>(std::lround(q[i] * unit));
    // Rounds towards zero, so that the result stays within the limit.
    for (std::size_t i = 0; i < w.size(); ++i) run.w[i][k] = static_cast<std::int32_t>(w[i] * kept);
  }
}

void Mirror::hide(Slot slot) {
  ++mishaps_.removed;
  unexplained_ = slot;
}

// Once an update, because all bodies may be lost at once.
void Mirror::explain(const engine::Bodies& bodies) {
  if (!unexplained_) return;
  const Slot slot = *std::exchange(unexplained_, std::nullopt);
  constexpr std::string_view kAxes = "xyz";
  std::string why;
  if (bodies.type[slot] >= type_count_) {
    why = fmt::format("its type is {}, but the session has only {} types", bodies.type[slot], type_count_);
  } else if (target_.groups().orientation) {
    double norm = 0;
    for (const auto& column : bodies.orientation) norm += double{column[slot]} * double{column[slot]};
    why = std::abs(norm - 1) <= kNormSlack ? "its angular velocity is not a number"
                                           : fmt::format("its orientation has norm {:.3g}", std::sqrt(norm));
  }
  for (std::size_t i = kPositionChannels; i-- > 0;) {
    const double p = double{bodies.position[i][slot]}, v = double{bodies.velocity[i][slot]};
    if (!std::isfinite(v)) why = fmt::format("its velocity along {} is not a number", kAxes[i]);
    if (std::isnan(p)) {
      why = fmt::format("its {} is not a number", kAxes[i]);
    } else if (std::abs(p) > extent_) {
      why = fmt::format("its {} is {:.4g}, beyond the extent, {:.4g}", kAxes[i], p, extent_);
    }
  }
  last_hidden_ = fmt::format("slot {} ({})", slot, why);
}

void Mirror::list_all_blocks() {
  busy_.clear();
  for (std::uint32_t block = 0; block < blocks_.size(); ++block) busy_.push_back(block);
}

void Mirror::start(const engine::Bodies& bodies) {
  lifecycle_.clear();
  list_all_blocks();
  quantise(bodies, {});
  for (Slot s = 0; s < target_.capacity(); ++s) {
    expelled_[s] = static_cast<std::uint8_t>(bodies.alive[s] != 0 && shown_[s] == 0);
    if (expelled_[s] != 0) hide(s);
    target_.alive()[s] = shown_[s];
    target_.reuse()[s] = 0;
    target_.type()[s] = bodies.type[s];
    generations_[s] = shown_[s];
    if (shown_[s] == 0) target_.despawn(s);
  }
  for (BlockNews& news : blocks_) news.told_of = true;
  explain(bodies);
}

void Mirror::save(std::vector<std::uint8_t>& next_reuse, std::vector<std::uint8_t>& withheld) const {
  next_reuse = generations_;
  withheld = expelled_;
}

void Mirror::restore(std::span<const std::uint8_t> next_reuse, std::span<const std::uint8_t> withheld) {
  TANDEM_ASSERT(next_reuse.size() == shown_.size() && withheld.size() == shown_.size());
  for (Slot s = 0; s < target_.capacity(); ++s) {
    // A body that was hidden and is not any more is another one.
    generations_[s] = static_cast<std::uint8_t>(next_reuse[s] + (withheld[s] != 0 ? shown_[s] : 0));
    if (shown_[s] != 0) target_.reuse()[s] = static_cast<std::uint8_t>(generations_[s] - 1);
  }
  for (std::uint64_t& number : numbers_) ++number;
}

void Mirror::update(const engine::Bodies& bodies, std::span<const engine::Event> events,
                    std::span<const std::uint8_t> moved, const RunBlocks& run) {
  TANDEM_ASSERT(bodies.alive.size() == shown_.size() && bodies.type.size() == shown_.size());
  lifecycle_.clear();
  for (const engine::Event& event : events) {
    if (event.slot >= marks_.size()) continue;
    marks_[event.slot] |= mark(event.kind);
    blocks_[event.slot / kBlockSlots].told_of = true;
  }
  busy_.clear();
  for (std::uint32_t block = 0; block < blocks_.size(); ++block) {
    // What the records of the frame before could not tell, those of this frame do.
    if (moved.size() != blocks_.size() || moved[block] != 0 || blocks_[block].told_of) busy_.push_back(block);
  }
  quantise(bodies, run);
  for (const std::uint32_t block : busy_) {
    if (blocks_[block].restless) record_block(bodies, block);
  }
  explain(bodies);
}

void Mirror::record_block(const engine::Bodies& bodies, std::uint32_t block) {
  const std::span<const std::uint8_t> was = target_.alive();
  const std::span<const TypeId> type = target_.type();
  const std::size_t records = lifecycle_.size();
  const Slot end = std::min(target_.capacity(), (block + 1) * kBlockSlots);
  for (Slot s = block * kBlockSlots; s < end; ++s) {
    const bool hidden = bodies.alive[s] != 0 && shown_[s] == 0;
    const bool quiet = marks_[s] == 0 && was[s] == shown_[s] && (expelled_[s] != 0) == hidden;
    if (quiet && (shown_[s] == 0 || type[s] == bodies.type[s])) continue;
    record(s, bodies, marks_[s]);
    marks_[s] = 0;
  }
  if (lifecycle_.size() == records) return;
  blocks_[block].told_of = true;
  ++numbers_[block];
}

void Mirror::record(Slot slot, const engine::Bodies& bodies, std::uint8_t marks) {
  const bool was = target_.alive()[slot] != 0;
  const bool shown = shown_[slot] != 0;
  const auto hidden = static_cast<std::uint8_t>(bodies.alive[slot] != 0 && !shown);
  if (hidden > expelled_[slot]) hide(slot);
  expelled_[slot] = hidden;
  if (!shown) target_.despawn(slot);

  const TypeId type = bodies.type[slot];
  const bool reused = was && shown && (marks & kSpawned) != 0;
  if (was && (!shown || reused)) {
    lifecycle_.push_back({.kind = LifecycleKind::kDespawn, .slot = slot, .reuse = 0, .type = 0, .body = {}});
  }
  if (shown && (!was || reused)) {
    spawn(slot, type);
  } else if (shown && (marks & kTeleported) != 0) {
    // A slot gets one record per frame. A type that changed in the same step still differs in the next one
    // and follows then.
    lifecycle_.push_back({.kind = LifecycleKind::kTeleport,
                          .slot = slot,
                          .reuse = 0,
                          .type = 0,
                          .body = target_.body(slot),
                          .groups = bits_of(target_.groups())});
  } else if (shown && target_.type()[slot] != type) {
    target_.type()[slot] = type;
    lifecycle_.push_back(
        {.kind = LifecycleKind::kTypeChange, .slot = slot, .reuse = 0, .type = type, .body = {}});
  }
}

void Mirror::spawn(Slot slot, TypeId type) {
  const std::uint8_t generation = generations_[slot]++;
  target_.alive()[slot] = 1;
  target_.reuse()[slot] = generation;
  target_.type()[slot] = type;
  lifecycle_.push_back({.kind = LifecycleKind::kSpawn,
                        .slot = slot,
                        .reuse = generation,
                        .type = type,
                        .body = target_.body(slot)});
}

}  // namespace tandem::host
