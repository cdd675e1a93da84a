#include "tests/bench/lab/framerate/paper_numbers.hpp"

#include <algorithm>
#include <array>

namespace tandem::lab {
namespace {

constexpr std::array<std::string_view, 4> kMethods{"client-only", "none", "entropy", "limited"};

// A line of table 5.6; 0 means not measured.
struct Line {
  int scene;
  std::uint32_t bodies;
  std::array<double, kMethods.size()> updates_per_s;
};

constexpr std::array<Line, 13> kTable{{
    {1, 5000, {8.9, 19.2, 100.1, 118.1}},
    {1, 10000, {4.4, 8.0, 77.9, 86.7}},
    {1, 20000, {2.6, 4.6, 40.4, 46.1}},
    {2, 5000, {6.6, 16.4, 107.4, 109.3}},
    {2, 10000, {3.4, 8.5, 73.0, 85.0}},
    {2, 20000, {2.3, 8.3, 40.0, 43.0}},
    {3, 5000, {2.6, 18.0, 77.2, 77.3}},
    {3, 10000, {1.3, 8.7, 39.1, 41.27}},
    {3, 20000, {0.9, 4.3, 18.5, 19.1}},
    {4, 5000, {0, 4.2, 68.9, 81.2}},
    {4, 10000, {0, 2.1, 46.2, 60.5}},
    {5, 5000, {0, 3.9, 26.9, 37.2}},
    {5, 10000, {0, 2.1, 18.7, 25.8}},
}};

}  // namespace

std::optional<std::uint32_t> paper_framerate_users(int scene) {
  if (scene < 1 || scene > 5) return std::nullopt;
  return scene < 4 ? 1 : 4;
}

std::optional<double> paper_updates_per_s(int scene, std::uint32_t bodies, std::string_view method) {
  const auto* const line = std::ranges::find_if(
      kTable, [&](const Line& one) { return one.scene == scene && one.bodies == bodies; });
  const auto* const column = std::ranges::find(kMethods, method);
  if (line == kTable.end() || column == kMethods.end()) return std::nullopt;
  const double value = line->updates_per_s[static_cast<std::size_t>(column - kMethods.begin())];
  return value > 0 ? std::optional(value) : std::nullopt;
}

}  // namespace tandem::lab
