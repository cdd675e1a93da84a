#pragma once
// TrackerFilter::move() for many neighbours side by side, in vector loops. It gives the same bits.

#include <array>
#include <cstdint>
#include <span>

#include "sdk/core/codec/tracker/filter.hpp"

namespace tandem {

/// The memory of the codec for a run of slots. Each column begins at the first slot of the run.
struct FilterColumns {
  std::uint8_t* age = nullptr;
  std::uint8_t* interval = nullptr;
  std::array<std::int8_t*, 3> steps{};
  std::uint8_t* history = nullptr;  ///< flag_history()
};

/// Corrects the bodies of a stream without orientations where many neighbours are corrected: all slots of a
/// run are computed, and those without a correction are left as they were. This takes a tenth of the time for
/// each slot.
class FilterRun {
 public:
  static constexpr std::uint32_t kSlots = 512;
  /// If a run has fewer corrections, it is faster to apply each by itself.
  static constexpr std::uint32_t kFewest = kSlots / 12;

  /// `filter` and `gains` must outlive it.
  FilterRun(const TrackerFilter& filter, const TrackerGains& gains);
  /// False if the numbers of some correction do not fit 32 bits; then apply() must not be called.
  [[nodiscard]] bool fits() const { return fits_; }
  /// True for a correction that apply() can take.
  [[nodiscard]] static bool fits(const TrackerCorrection& correction) {
    const auto is_short = [](std::int32_t steps) { return steps >= -kMaxSteps && steps <= kMaxSteps; };
    return is_short(correction.steps[0]) && is_short(correction.steps[1]) && is_short(correction.steps[2]);
  }
  /// Applies the corrections of bodies among the `count` slots from `first` on, count <= kSlots. Afterwards
  /// their age is `youngest`. Corrections that do not fit are left out.
  void apply(std::span<const Slot> slots, const TrackerCorrection* corrections, Slot first,
             std::uint32_t count, const FilterColumns& columns, std::uint8_t youngest, State& state) const;

 private:
  static constexpr std::int32_t kMaxSteps = 63;

  const TrackerFilter& filter_;
  // G and H of one step, by its unit and by k; see TrackerFilter.
  using Shares = std::array<std::array<std::int32_t, kMaxAge + 1>, 4>;
  Shares velocity_{}, acceleration_{};
  bool fits_ = true;
};

}  // namespace tandem
