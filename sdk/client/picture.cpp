#include "sdk/client/picture.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::client {
namespace {

bool uses(const Picture& picture, const DrawnFrame& frame) {
  return picture.before == &frame || picture.agreed == &frame || picture.ahead == &frame;
}

}  // namespace

void draw(const State& state, Frame frame, std::span<const std::uint8_t> jumps, DrawnFrame& drawn) {
  const auto copy = [](const auto& from, auto& to) { to.assign(from.begin(), from.end()); };
  drawn.frame = frame;
  for (std::size_t channel = 0; channel < kPositionChannels; ++channel) {
    copy(state.p(channel), drawn.p[channel]);
    copy(state.v(channel), drawn.v[channel]);
  }
  for (std::size_t channel = 0; channel < kQuaternionChannels; ++channel)
    copy(state.q(channel), drawn.q[channel]);
  for (std::size_t channel = 0; channel < kSpinChannels; ++channel) copy(state.w(channel), drawn.w[channel]);
  copy(state.alive(), drawn.alive);
  copy(state.reuse(), drawn.generation);
  copy(state.type(), drawn.type);
  copy(jumps, drawn.jumps);
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
