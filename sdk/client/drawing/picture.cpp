#include "sdk/client/drawing/picture.hpp"

#include <algorithm>
#include <cstdlib>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::client {
namespace {

bool uses(const Picture& picture, const DrawnFrame& frame) {
  return picture.before == &frame || picture.agreed == &frame || picture.ahead == &frame;
}

}  // namespace

void Accelerations::forget(std::size_t capacity) {
  for (auto& axis : a) axis.assign(capacity, 0);
  falls.assign(capacity, 0);
  gravity = {};
}

void Accelerations::learn(const State& before, const State& after, const Vec3i& drive) {
  gravity = drive;
  std::int32_t strongest = 0;
  for (const std::int32_t g : gravity) strongest = std::max(strongest, std::abs(g));
  const std::int32_t most = strongest + strongest / 2;
  const std::int32_t close = strongest / 8;
  for (std::size_t slot = 0; slot < falls.size(); ++slot) {
    bool steady = true;
    bool as_gravity = strongest > 0;
    Vec3i change{};
    for (std::size_t axis = 0; axis < kPositionChannels; ++axis) {
      change[axis] = after.v(axis)[slot] - before.v(axis)[slot];
      steady &= std::abs(change[axis]) <= most;
      as_gravity &= std::abs(change[axis] - gravity[axis]) <= close;
    }
    for (std::size_t axis = 0; axis < kPositionChannels; ++axis) a[axis][slot] = steady ? change[axis] : 0;
    falls[slot] = as_gravity ? 1 : 0;
  }
}

void draw(const State& state, Frame frame, std::span<const std::uint8_t> jumps,
          const Accelerations& accelerations, DrawnFrame& drawn) {
  const auto copy = [](const auto& from, auto& to) { to.assign(from.begin(), from.end()); };
  const std::size_t capacity = state.capacity();
  drawn.frame = frame;
  drawn.gravity = accelerations.gravity;
  copy(state.alive(), drawn.alive);
  copy(state.reuse(), drawn.reuse);
  copy(state.type(), drawn.type);
  copy(jumps, drawn.jumps);
  drawn.motion.resize(capacity);
  drawn.alive_count = 0;
  for (std::size_t slot = 0; slot < capacity; ++slot) {
    const unsigned moves = drawn.alive[slot] & (state.rest()[slot] ^ 1U);
    const unsigned falls = accelerations.falls[slot] != 0 ? DrawnFrame::kFalls : 0U;
    drawn.motion[slot] = static_cast<std::uint8_t>(moves * (DrawnFrame::kMoves | falls));
    drawn.alive_count += drawn.alive[slot];
  }
  for (std::size_t channel = 0; channel < kPositionChannels; ++channel) {
    copy(state.p(channel), drawn.p[channel]);
    const std::span<const std::int32_t> v = state.v(channel);
    const std::vector<std::int32_t>& a = accelerations.a[channel];
    drawn.v[channel].resize(capacity);
    for (std::size_t slot = 0; slot < capacity; ++slot)
      drawn.v[channel][slot] = v[slot] + a[slot] * (drawn.motion[slot] & DrawnFrame::kMoves);
  }
  for (std::size_t channel = 0; channel < kQuaternionChannels; ++channel)
    copy(state.q(channel), drawn.q[channel]);
  for (std::size_t channel = 0; channel < kSpinChannels; ++channel) copy(state.w(channel), drawn.w[channel]);
}

DrawnFrame& PictureExchange::unused(const Picture& next) {
  const Lock lock(mutex_);
  const auto found = std::find_if(frames_.begin(), frames_.end(), [&](const DrawnFrame& frame) {
    return !uses(next, frame) && !(last_ && uses(*last_, frame)) && !(read_ && uses(*read_, frame));
  });
  TANDEM_ASSERT(found != frames_.end());
  return *found;
}

void PictureExchange::show(const Picture& picture) {
  const Lock lock(mutex_);
  last_ = picture;
}

void PictureExchange::clear() {
  const Lock lock(mutex_);
  last_.reset();
}

PictureExchange::Reading::Reading(PictureExchange& exchange) : exchange_(exchange), turn_(exchange.readers_) {
  const Lock lock(exchange_.mutex_);
  exchange_.read_ = exchange_.last_;
}

PictureExchange::Reading::~Reading() {
  const Lock lock(exchange_.mutex_);
  exchange_.read_.reset();
}

const Picture* PictureExchange::Reading::picture() const {
  return exchange_.read_ ? &*exchange_.read_ : nullptr;
}

}  // namespace tandem::client
