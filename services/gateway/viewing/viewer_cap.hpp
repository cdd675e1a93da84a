#pragma once
// What one viewer's connection takes, and may take.

#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>

#include "sdk/wire/units.hpp"

namespace tandem::gateway {

/// Adds up bytes over two seconds that end together with a quarter of a second. Not thread-safe.
class RecentBytes {
 public:
  static constexpr std::int64_t kBinNs = kSecond / 4;
  static constexpr std::size_t kBins = 8;
  static constexpr double kSeconds = 2;

  void add(std::uint64_t bytes, std::int64_t now_ns) {
    advance(now_ns);
    current_ += bytes;
  }
  /// What was added before counts no more.
  void restart() { *this = {}; }
  /// Of the last two seconds; empty until they are over.
  [[nodiscard]] std::optional<std::uint64_t> in_two_seconds(std::int64_t now_ns) {
    advance(now_ns);
    if (complete_ < kBins) return std::nullopt;
    return std::accumulate(bins_.begin(), bins_.end(), std::uint64_t{0});
  }

 private:
  void advance(std::int64_t now_ns) {
    const std::int64_t number = now_ns / kBinNs;
    if (number_ && number - *number_ > static_cast<std::int64_t>(kBins)) restart();
    if (!number_) number_ = number;
    for (; *number_ < number; ++*number_) {
      bins_[complete_++ % kBins] = current_;
      current_ = 0;
    }
  }

  std::optional<std::int64_t> number_;  // of the bin that is filled, counted from the clock's start
  std::uint64_t current_ = 0;
  std::uint64_t complete_ = 0;  // bins
  std::array<std::uint64_t, kBins> bins_{};
};

/// A viewer's cap. Not thread-safe.
class ViewerCap {
 public:
  /// What a viewer says in between waits, so that one that flips its cap costs nothing.
  static constexpr std::int64_t kKeptNs = 2 * kSecond;
  static constexpr double kTolerance = 1.05;

  void want(std::uint32_t kbit_s, std::int64_t now_ns) {
    wanted_ = kbit_s;
    adopt(now_ns);
  }
  /// Takes what was said last, if it may by now.
  void adopt(std::int64_t now_ns) {
    if (wanted_ == kbit_s_ || (changed_ns_ && now_ns - *changed_ns_ < kKeptNs)) return;
    kbit_s_ = wanted_;
    changed_ns_ = now_ns;
  }
  [[nodiscard]] std::uint32_t kbit_s() const { return kbit_s_; }  ///< 0: none

  /// The connection took so much on the network, in either direction.
  void took(std::uint64_t bytes, std::int64_t now_ns) { taken_.add(bytes, now_ns); }
  /// It joins or catches up, which counts for nothing.
  void excuse() { taken_.restart(); }
  /// What the last two seconds took, in kbit/s, if that is above the cap; else 0.
  [[nodiscard]] double over_kbit_s(std::int64_t now_ns) {
    const auto bytes = taken_.in_two_seconds(now_ns);
    const double kbit_s = bytes ? static_cast<double>(*bytes) * 8 / 1000 / RecentBytes::kSeconds : 0;
    return kbit_s_ > 0 && kbit_s > kTolerance * kbit_s_ ? kbit_s : 0;
  }

 private:
  std::uint32_t kbit_s_ = 0, wanted_ = 0;
  std::optional<std::int64_t> changed_ns_;
  RecentBytes taken_;
};

}  // namespace tandem::gateway
