#include "sdk/core/codec/stillness.hpp"

#include <algorithm>

#include "sdk/core/codec/errors.hpp"

namespace tandem {
namespace {

// A body is slow below 1/kSlow of a threshold per frame. At 4 recordings with resting bodies take 1 % fewer
// bits and have a 2 % larger RMS error, and the thesis's scenes take up to 1.5 % more bits; at 2 up to 14 %
// more; at 16 recordings take 5 % more (RESEARCH.md).
constexpr std::int64_t kSlow = 8;
constexpr std::int64_t kMaxPush = std::int64_t{1} << 29;  // so that four times a squared length fits

}  // namespace

Stillness::Stillness(std::uint32_t capacity, std::span<const std::int32_t> radii)
    : radii_(radii), frames_(capacity), past_(block_count(capacity)) {
  for (Places& places : places_) {
    for (auto& column : places) column.resize(capacity);
  }
  if (radii.empty()) return;
  for (auto& column : q_) column.resize(capacity);
}

void Stillness::begin(const CodecFrame& frame) {
  for (const Slot slot : frame.renewed) {
    frames_[slot] = 0;
    past_[slot / kBlockSlots].frames = 0;
  }
}

void Stillness::put(const State& target, const Block& block, std::size_t places) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    std::copy_n(target.p(axis).data() + block.first, block.slots, places_[places][axis].data() + block.first);
}

void Stillness::remember(const CodecFrame& frame, const State& target, const Block& block) {
  Past& past = past_[block.index];
  if (past.frames < 2) {
    ++past.frames;
    for (Slot slot = block.first; slot < block.first + block.slots; ++slot)
      frames_[slot] = static_cast<std::uint8_t>(std::min(frames_[slot] + 1, 2));
  }
  const std::uint64_t number = number_of(frame.known.target, block.index);
  const bool stands = number != 0 && number == past.number;
  if (stands && past.stood) return;
  past.number = number;
  past.stood = stands;
  past.newest = static_cast<std::uint8_t>(1 - past.newest);
  put(target, block, past.newest);
  for (std::size_t i = 0; i < kQuaternionChannels && !radii_.empty(); ++i)
    std::copy_n(target.q(i).data() + block.first, block.slots, q_[i].data() + block.first);
}

bool Stillness::is_still(const CodecFrame& frame, const State& target, Slot slot) const {
  const std::uint8_t frames = frames_[slot];
  if (frames == 0) return false;
  const std::uint8_t newest = past_[slot / kBlockSlots].newest;
  const Places &last = places_[newest], &before_last = places_[newest ^ 1U];
  // Wraps at 2^31, which counts as far in either direction.
  const auto way = [](std::int32_t from, std::int32_t to) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(to) - static_cast<std::uint32_t>(from));
  };
  const std::int64_t slow = frame.parameters.threshold / kSlow;
  std::int64_t moved = 0, pushed = 0, fall = 0;  // squared; the last two in 1/64 units
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t d = way(last[axis][slot], target.p(axis)[slot]);
    if (d < -slow || d > slow) return false;
    // For a body that was seen for two frames it is unknown: the body counts as standing.
    const std::int64_t before = frames < 2 ? d : way(before_last[axis][slot], last[axis][slot]);
    const std::int64_t g = frame.gravity[axis];
    // The acceleration besides gravity. The limit lets squares fit and is above what gravity can cause.
    const std::int64_t a = std::clamp((d - before) * 64 - g, -kMaxPush, kMaxPush);
    moved += d * d;
    pushed += a * a;
    fall += g * g;
  }
  if (moved > slow * slow || 4 * pushed < fall) return false;
  if (radii_.empty()) return true;
  const BodyState now = target.body(slot);
  BodyState before = now;
  for (std::size_t axis = 0; axis < 3; ++axis) before.p[axis] = last[axis][slot];
  for (std::size_t i = 0; i < kQuaternionChannels; ++i) before.q[i] = q_[i][slot];
  return surface_error(before, now, radii_[target.type()[slot]]) <= static_cast<std::uint64_t>(slow);
}

}  // namespace tandem
