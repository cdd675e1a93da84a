#include "sdk/core/predict/still_step.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

void copy(const auto& from, auto to) { std::copy(from.begin(), from.end(), to.begin()); }

// Calls what(a's, b's) for what a step reads, of the columns that `a` has.
void each_column(auto& a, auto& b, const auto& what) {
  what(a.alive(), b.alive());
  what(a.type(), b.type());
  what(a.rest(), b.rest());
  what(a.own(), b.own());
  for (std::size_t i = 0; i < kColumns; ++i)
    if (!a.column(i).empty()) what(a.column(i), b.column(i));
}

}  // namespace

bool has_turned(const Vec3i& before, const Vec3i& now) {
  std::int64_t turned = 0;
  std::int64_t most = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t change = std::int64_t{now[i]} - before[i];
    turned = std::max({turned, change, -change});
    most = std::max<std::int64_t>({most, now[i], -now[i]});
  }
  return 50 * turned > most;
}

StillStep::StillStep(std::uint32_t capacity, const Groups& moved) : state_(capacity, moved) {
  state_.keep_for_predictor(1);
}

bool StillStep::is(const State& from, const StepInput& input) const {
  if (!known_ || !(input == input_)) return false;
  bool same = true;
  each_column(state_, from, [&same](const auto& known, const auto& now) {
    same = same && std::equal(now.begin(), now.end(), known.begin());
  });
  return same;
}

void StillStep::remember(const State& state, const StepInput& input) {
  TANDEM_ASSERT(state.capacity() == state_.capacity() && state.own().size() == state_.own().size());
  each_column(state_, state, [](auto known, const auto& now) { copy(now, known); });
  input_ = input;
  known_ = true;
}

void StillStep::copy_unmoved(const State& from, State& to) const {
  if (&from == &to) return;
  copy(from.alive(), to.alive());
  copy(from.reuse(), to.reuse());
  copy(from.type(), to.type());
  for (Slot s = 0; s < from.capacity(); ++s) {
    if (from.alive()[s] != 0) continue;
    for (std::size_t i = 0; i < kColumns; ++i)
      if (!state_.column(i).empty() && !to.column(i).empty()) to.column(i)[s] = 0;
    to.own()[s] = 0;
  }
}

void StillStep::repeat(const State& from, State& to) const {
  if (&from == &to) return;
  copy_unmoved(from, to);
  copy(from.rest(), to.rest());
  copy(from.own(), to.own());
  for (std::size_t i = 0; i < kColumns; ++i)
    if (!state_.column(i).empty()) copy(from.column(i), to.column(i));
}

}  // namespace tandem
