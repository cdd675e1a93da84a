// SPDX-License-Identifier: MIT
#pragma once
// Bodies of all sizes as a bounded number of types, whose lines fit into a HELLO (idl/ENGINE.md).

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace tandem_lammps {

/// The most types of a HELLO: 64 KiB have room for them and for all else.
constexpr std::uint32_t kMaxTypes = 800;

/// Radii from `least` to `most`, both above 0, as at most `max_count` classes. A class's radius is wrong by
/// at most 1 % for all that it stands for, or by as little as so few classes allow.
class RadiusClasses {
 public:
  RadiusClasses(double least, double most, std::uint32_t max_count) : least_(least) {
    const double span = std::log(std::max(most / least, 1.0));
    // Less than that is one radius that was rounded.
    count_ = span < 2e-6 ? 1U
                         : static_cast<std::uint32_t>(std::clamp(std::ceil(span / (2 * std::log1p(0.01))),
                                                                 1.0, std::max<double>(max_count, 1)));
    width_ = span / count_;
  }
  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] double radius(std::uint32_t index) const { return least_ * std::exp(width_ * (index + 0.5)); }
  /// The class of a radius; the nearest one of a radius outside.
  [[nodiscard]] std::uint32_t index_of(double radius) const {
    if (count_ == 1 || !(radius > least_)) return 0;
    return static_cast<std::uint32_t>(std::min(std::log(radius / least_) / width_, count_ - 1.0));
  }
  /// The largest error, as a part of the radius.
  [[nodiscard]] double error() const { return std::expm1(width_ / 2); }

 private:
  double least_, width_;
  std::uint32_t count_;
};

}  // namespace tandem_lammps
