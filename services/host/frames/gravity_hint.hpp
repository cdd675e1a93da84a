#pragma once
// Notices a gravity that a simulation has and does not tell.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/core/lattice/state.hpp"
#include "services/host/streams/lattice_choice.hpp"

namespace tandem::host {

/// Looks at a sample of the bodies. Not thread-safe.
class GravityHint {
 public:
  GravityHint(const Lattice& lattice, std::int32_t threshold) : lattice_(lattice), threshold_(threshold) {}

  /// Call after each step of a simulation whose gravity is 0. Returns a line for people once: when all bodies
  /// have accelerated alike for a while, by more than a threshold in a second. Otherwise an empty one.
  [[nodiscard]] std::string look(const State& bodies);

 private:
  static constexpr std::uint32_t kSample = 256, kLeastBodies = 8;
  static constexpr int kAlikeFrames = 15;  // half a second of 30 Hz: longer than a push
  struct Seen {
    bool alive = false;
    std::uint8_t reuse = 0;
    std::array<std::int32_t, 3> v{};
  };
  /// The change of velocity that the bodies have in common, velocity units; all 0: none.
  [[nodiscard]] std::array<double, 3> common_change(const std::vector<Seen>& now) const;

  Lattice lattice_;
  std::int32_t threshold_;
  std::vector<Seen> before_;
  std::array<double, 3> change_{};
  int alike_ = 0;
  bool told_ = false;
};

}  // namespace tandem::host
