#include "sdk/core/lattice/state.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {

State::State(std::uint32_t capacity, const Groups& groups)
    : alive_(capacity), reuse_(capacity), type_(capacity), rest_(capacity) {
  TANDEM_ASSERT(1 <= capacity && capacity <= kMaxCapacity);
  for_each_group(groups, [&](const ChannelGroup& group) {
    for_each_column(group,
                    [&](std::size_t column, const ColumnRun&) { columns_[column].assign(capacity, 0); });
  });
}

void State::keep_for_predictor(std::uint32_t bytes_a_slot) {
  own_.assign(std::size_t{bytes_a_slot} * capacity(), 0);
}

void State::renew(Slot slot, const BodyState& body) {
  set_body(slot, body);
  for (std::size_t at = slot; at < own_.size(); at += capacity()) own_[at] = 0;
}

BodyState State::body(Slot slot) const {
  BodyState body;
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    body.p[i] = p(i)[slot];
    body.v[i] = v(i)[slot];
  }
  if (!groups().orientation) return body;
  body.q = quaternion(slot);
  for (std::size_t i = 0; i < kSpinChannels; ++i) body.w[i] = w(i)[slot];
  return body;
}

void State::set_body(Slot slot, const BodyState& body) {
  rest_[slot] = 0;
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    p(i)[slot] = std::clamp(body.p[i], -kPositionLimit, kPositionLimit);
    v(i)[slot] = std::clamp(body.v[i], -kVelocityLimit, kVelocityLimit);
    c(i)[slot] = 0;
  }
  if (!groups().orientation) return;
  set_quaternion(slot, body.q);
  for (std::size_t i = 0; i < kSpinChannels; ++i) w(i)[slot] = body.w[i];
}

void State::spawn(Slot slot, std::uint8_t reuse, TypeId type, const BodyState& body) {
  alive_[slot] = 1;
  reuse_[slot] = reuse;
  type_[slot] = type;
  renew(slot, body);
}

void State::despawn(Slot slot) {
  renew(slot, BodyState{{}, {}, {}, {}});
  alive_[slot] = 0;
  reuse_[slot] = 0;
  type_[slot] = 0;
}

std::uint32_t State::alive_count() const {
  return static_cast<std::uint32_t>(std::count(alive_.begin(), alive_.end(), std::uint8_t{1}));
}

std::uint32_t State::rest_count() const {
  return static_cast<std::uint32_t>(std::count(rest_.begin(), rest_.end(), std::uint8_t{1}));
}

}  // namespace tandem
