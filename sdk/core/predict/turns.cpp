#include "sdk/core/predict/turns.hpp"

#include <algorithm>

namespace tandem {

void turn_bodies(const State& from, State& to) {
  if (!to.groups().orientation) return;
  TurnColumns columns{};
  for (std::size_t i = 0; i < kQuaternionChannels; ++i) {
    columns.from[i] = from.q(i).data();
    columns.to[i] = to.q(i).data();
  }
  for (std::size_t i = 0; i < kSpinChannels; ++i) {
    columns.spin[i] = from.w(i).data();
    if (&from != &to) std::copy(from.w(i).begin(), from.w(i).end(), to.w(i).begin());
  }
  turn_all(columns, to.rest());
}

void turn_bodies(const State& from, State& to, std::span<const Slot> slots) {
  if (!to.groups().orientation) return;
  for (const Slot slot : slots) {
    const Spin w{from.w(0)[slot], from.w(1)[slot], from.w(2)[slot]};
    const Quaternion q = from.quaternion(slot);
    to.set_quaternion(slot, to.rest()[slot] != 0 ? q : turned(q, w));
    for (std::size_t i = 0; i < kSpinChannels; ++i) to.w(i)[slot] = w[i];
  }
}

}  // namespace tandem
