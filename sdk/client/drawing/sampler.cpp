#include "sdk/client/drawing/sampler.hpp"

#include <algorithm>
#include <cstring>
#include <string>

namespace tandem::client {
namespace {

constexpr double kSpinScale = 1.0 / (1 << 28);
constexpr double kLeastSmoothingS = 1e-6;  // a shorter time counts as 0, because velocities are divided by it
constexpr double kMaxSmoothingS = 10;

template <class T>
std::byte* slot_of(const Column<T>& column, std::size_t slot) {
  return reinterpret_cast<std::byte*>(column.first) + slot * column.stride;
}

/// The values of a run of slots, from `begin` on.
template <class T>
void put(const Column<T>& column, std::size_t begin, const T* from, std::size_t count) {
  if (column.first == nullptr) return;
  if (column.stride == sizeof(T)) {
    std::memcpy(slot_of(column, begin), from, count * sizeof(T));
    return;
  }
  for (std::size_t i = 0; i < count; ++i) std::memcpy(slot_of(column, begin + i), from + i, sizeof(T));
}

template <std::size_t N>
void put_one(const Column<float>& column, std::size_t slot, const std::array<float, N>& value) {
  if (column.first != nullptr) std::memcpy(slot_of(column, slot), value.data(), sizeof value);
}

}  // namespace

/// The work data of slots begin .. begin + count - 1.
struct Sampler::Run {
  std::size_t begin = 0, count = 0;
  std::array<std::uint8_t, kRun> changes{};  // BodyChange
  bool changed = false;                      // any of them changed
  Numbers speeds{};
  std::array<Extra, kPositionChannels> extra{};
};

// Begins another epoch: all its bodies are new. If memory runs out on the way, the next sample begins again.
void Sampler::begin(const Picture& picture) {
  const std::size_t capacity = picture.agreed->alive.size();
  epoch_ = 0;
  for (auto& axis : place_) axis.assign(capacity, 0);
  for (auto& axis : speed_) axis.assign(capacity, 0);
  turns_.assign(picture.agreed->has_orientations() ? capacity : 0, Rotation{0, 0, 0, 1});
  alive_.assign(capacity, 0);
  reuse_.assign(capacity, 0);
  jumps_.assign(capacity, 0);
  capacity_ = capacity;
  shown_ = {};
  epoch_ = picture.epoch;
}

bool Sampler::tell_changes(const Picture& picture, Run& run) {
  const DrawnFrame& agreed = *picture.agreed;
  const bool all_jumped = load_ != picture.load;
  const auto same = [&run](const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
    return std::memcmp(a.data() + run.begin, b.data() + run.begin, run.count) == 0;
  };
  run.changes.fill(static_cast<std::uint8_t>(BodyChange::kNone));
  if (!all_jumped && same(alive_, agreed.alive) && same(reuse_, agreed.reuse) && same(jumps_, agreed.jumps))
    return false;
  for (std::size_t i = 0; i < run.count; ++i) {
    const std::size_t slot = run.begin + i;
    const bool was = alive_[slot] != 0;
    const bool is = agreed.alive[slot] != 0;
    BodyChange change = BodyChange::kNone;
    if (is && (!was || reuse_[slot] != agreed.reuse[slot])) {
      change = BodyChange::kNew;
    } else if (was && !is) {
      change = BodyChange::kGone;
    } else if (is && (all_jumped || jumps_[slot] != agreed.jumps[slot])) {
      change = BodyChange::kJumped;
    }
    run.changes[i] = static_cast<std::uint8_t>(change);
    alive_[slot] = agreed.alive[slot];
    reuse_[slot] = agreed.reuse[slot];
    jumps_[slot] = agreed.jumps[slot];
  }
  return true;
}

void Sampler::fill_extra(const SampledMoment& moment, Run& run) {
  const DrawnFrame& at = *moment.at;
  for (std::size_t axis = 0; axis < kPositionChannels; ++axis) {
    const float gravity = kVelocityScale * static_cast<float>(at.gravity[axis]);
    const float echoed = kVelocityScale * moment.echo_gravity[axis];
    Extra& extra = run.extra[axis];
    for (std::size_t i = 0; i < run.count; ++i) {
      const std::uint8_t motion = at.motion[run.begin + i];
      const float fall = (motion & DrawnFrame::kFalls) != 0 ? gravity : 0;
      const float echo = (motion & DrawnFrame::kMoves) != 0 ? echoed : 0;
      extra.place[i] = fall * moment.fall.place + echo * moment.echo.place;
      extra.way[i] = fall * moment.fall.way + echo * moment.echo.way;
      extra.speed[i] = fall * moment.fall.speed + echo * moment.echo.speed;
    }
  }
}

void Sampler::show_places(const SampledMoment& moment, const Smoothing& smoothing,
                          const SampleColumns& columns, const Picture& picture, Run& run) {
  const DrawnFrame& at = *moment.at;
  const bool extra = moment.fall.any() || moment.echo.any();
  if (extra) fill_extra(moment, run);
  const std::size_t begin = run.begin;
  for (std::size_t axis = 0; axis < kPositionChannels; ++axis) {
    const std::int32_t* const places = at.p[axis].data() + begin;
    if (moment.from == nullptr) {
      read_speeds(at.v[axis].data() + begin, run.count, run.speeds.data());
    } else {
      read_ways(moment.from->p[axis].data() + begin, places, moment.from->jumps.data() + begin,
                at.jumps.data() + begin, run.count, run.speeds.data());
    }
    float* const shown_place = place_[axis].data() + begin;
    float* const shown_speed = speed_[axis].data() + begin;
    const Extra* const more = extra ? &run.extra[axis] : nullptr;
    show(places, run.speeds.data(), more, run.count, moment.span, smoothing, shown_place, shown_speed);
    if (!run.changed) continue;
    // Bodies that are new or have jumped have no offset to decay.
    for (std::size_t i = 0; i < run.count; ++i) {
      if (run.changes[i] == static_cast<std::uint8_t>(BodyChange::kNone)) continue;
      show(places + i, run.speeds.data() + i, nullptr, 1, moment.span, {}, shown_place + i, shown_speed + i);
    }
  }
  const auto unit = static_cast<float>(picture.lattice_unit);
  const auto rate_hz = static_cast<float>(1e9 / picture.pacer.period_ns());
  const auto put = [&](const Column<float>& column, const auto& axes, float scale) {
    if (column.first == nullptr) return;
    put_vectors(axes[0].data() + begin, axes[1].data() + begin, axes[2].data() + begin, scale, run.count,
                slot_of(column, begin), column.stride);
  };
  put(columns.positions, place_, unit);
  put(columns.velocities, speed_, unit * rate_hz);
}

void Sampler::show_turns(const SampledMoment& moment, float blend, const SampleColumns& columns,
                         const Picture& picture, const Run& run) {
  const DrawnFrame& at = *moment.at;
  const auto spin_scale = static_cast<float>(kSpinScale * 1e9 / picture.pacer.period_ns()) * moment.span.pace;
  for (std::size_t i = 0; i < run.count; ++i) {
    const auto slot = static_cast<Slot>(run.begin + i);
    if (at.alive[slot] == 0) continue;
    const Spin spin = at.spin(slot);
    Rotation turn = to_rotation(at.quaternion(slot));
    if (moment.from == nullptr) {
      turn = turned_on(turn, spin, moment.span.after);
    } else if (moment.from->jumps[slot] == at.jumps[slot]) {
      turn = between(turn, to_rotation(moment.from->quaternion(slot)), -moment.span.after);
    }
    if (run.changes[i] == static_cast<std::uint8_t>(BodyChange::kNone) && blend > 0) {
      const Rotation expected = turned_on(turns_[slot], spin, moment.span.gap + moment.span.since);
      turn = between(turn, expected, blend);
    }
    turns_[slot] = turn;
    put_one(columns.orientations, slot, turn);
    put_one(columns.angular_velocities, slot,
            std::array<float, 3>{static_cast<float>(spin[0]) * spin_scale,
                                 static_cast<float>(spin[1]) * spin_scale,
                                 static_cast<float>(spin[2]) * spin_scale});
  }
}

Result<SampledFrame> Sampler::sample(const Picture& picture, const SampleRequest& request,
                                     const SampleColumns& columns, std::int64_t now_ns,
                                     const RunBlocks& run_blocks) {
  const DrawnFrame& agreed = *picture.agreed;
  const std::size_t capacity = agreed.alive.size();
  if (columns.capacity < capacity)
    return fail(ErrorCode::kCapacity, "the session holds " + std::to_string(capacity) +
                                          " slots, the columns " + std::to_string(columns.capacity));
  const bool had_orientations = !turns_.empty();
  if (epoch_ != picture.epoch || capacity_ != capacity || had_orientations != agreed.has_orientations())
    begin(picture);
  const std::int64_t at_ns = request.at_ns != 0 ? request.at_ns : now_ns;
  const auto later = [](std::int64_t from_ns, std::int64_t to_ns) {
    return std::max(0.0, static_cast<double>(to_ns) - static_cast<double>(from_ns));
  };
  const double period_ns = picture.pacer.period_ns();
  const double moved_on = later(last_at_ns_, at_ns) / period_ns;
  // Estimates of the server's clock go back now and then; what is drawn does not, unless the caller asks for
  // an earlier moment.
  Shown& shown = shown_[static_cast<std::size_t>(request.mode)];
  const bool may_go_back = request.at_ns != 0 && at_ns < shown.at_ns;
  const double least_frame = may_go_back ? 0 : shown.frame;
  const SampledMoment moment = moment_at(picture, request.mode, at_ns, least_frame, last_frame_, moved_on);
  const double smoothing_s =
      request.smoothing_s >= 0 ? std::min(request.smoothing_s, kMaxSmoothingS) : kSmoothingS;
  Smoothing smoothing;
  if (request.mode == SampleMode::kExtrapolate) {
    // The time by the clock; if the requested moments leap ahead of it, the time of the leap. Otherwise an
    // offset that is carried further than it has decayed would grow from leap to leap.
    const double elapsed = std::max(later(last_ns_, now_ns) / period_ns, moved_on);
    const double constant = smoothing_s >= kLeastSmoothingS ? smoothing_s * 1e9 / period_ns : 0;
    smoothing = Smoothing::exponential(elapsed, constant);
  }
  run_jobs(block_count(static_cast<std::uint32_t>(capacity)), run_blocks, [&](std::uint32_t block) {
    const std::size_t first = std::size_t{block} * kBlockSlots;
    const std::size_t end = std::min(first + kBlockSlots, capacity);
    Run run;
    for (run.begin = first; run.begin < end; run.begin += kRun) {
      run.count = std::min(kRun, end - run.begin);
      run.changed = tell_changes(picture, run);
      show_places(moment, smoothing, columns, picture, run);
      if (!turns_.empty()) show_turns(moment, smoothing.place, columns, picture, run);
      put(columns.changes, run.begin, run.changes.data(), run.count);
    }
    put(columns.types, first, agreed.type.data() + first, end - first);
    put(columns.alive, first, agreed.alive.data() + first, end - first);
    put(columns.reuse, first, agreed.reuse.data() + first, end - first);
  });
  load_ = picture.load;
  last_ns_ = now_ns;
  last_at_ns_ = at_ns;
  last_frame_ = moment.frame;
  shown = {moment.frame, may_go_back ? at_ns : std::max(at_ns, shown.at_ns)};
  return SampledFrame{.epoch = picture.epoch,
                      .frame = moment.frame,
                      .capacity = static_cast<std::uint32_t>(capacity),
                      .alive = agreed.alive_count,
                      .has_orientations = !turns_.empty(),
                      .since_delta_s = later(picture.agreed_ns, now_ns) / 1e9};
}

}  // namespace tandem::client
