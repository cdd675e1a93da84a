#pragma once
// Measures how much suspension one participant caused lately.

#include <array>
#include <cstdint>

namespace tandem::host {

/// The sum over a sliding window of 10 s, in steps of 0.1 s: a charge counts for 10.0 to 10.1 s. Constant
/// memory.
class StallMeter {
 public:
  static constexpr std::int64_t kStepNs = 100'000'000;
  static constexpr std::size_t kSteps = 101;

  /// Charges `duration_ns` at `now_ns`; time never goes back.
  void charge(std::int64_t now_ns, std::int64_t duration_ns);
  [[nodiscard]] std::int64_t total_ns(std::int64_t now_ns);

 private:
  void forget(std::int64_t now_ns);

  std::array<std::int64_t, kSteps> steps_{};
  std::int64_t step_ = 0;  // number of the newest step
  std::int64_t total_ = 0;
};

}  // namespace tandem::host
