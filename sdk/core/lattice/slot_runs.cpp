#include "sdk/core/lattice/slot_runs.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {

void copy_slots(const State& from, State& to, Slot first, std::uint32_t count) {
  TANDEM_ASSERT(first + count <= from.capacity() && from.capacity() == to.capacity());
  TANDEM_ASSERT(from.groups() == to.groups() && from.own().size() == to.own().size());
  const auto copy = [first, count](const auto& column, const auto& column_to) {
    if (!column.empty()) std::copy_n(column.data() + first, count, column_to.data() + first);
  };
  copy(from.alive(), to.alive());
  copy(from.reuse(), to.reuse());
  copy(from.type(), to.type());
  copy(from.rest(), to.rest());
  for (std::size_t at = 0; at < from.own().size(); at += from.capacity())
    copy(from.own().subspan(at, from.capacity()), to.own().subspan(at, from.capacity()));
  for (std::size_t number = 0; number < kColumns; ++number) copy(from.column(number), to.column(number));
}

void step_groups(const State& from, State& to, Slot first, std::uint32_t count) {
  if (!to.groups().orientation) return;
  TANDEM_ASSERT(first + count <= to.capacity() && from.capacity() == to.capacity());
  TANDEM_ASSERT(from.groups() == to.groups());
  TurnColumns columns{};
  for (std::size_t i = 0; i < kQuaternionChannels; ++i) {
    columns.from[i] = from.q(i).data() + first;
    columns.to[i] = to.q(i).data() + first;
  }
  for (std::size_t i = 0; i < kSpinChannels; ++i) {
    columns.spin[i] = from.w(i).data() + first;
    if (&from != &to) std::copy_n(from.w(i).data() + first, count, to.w(i).data() + first);
  }
  turn_all(columns, to.rest().subspan(first, count));
}

}  // namespace tandem
