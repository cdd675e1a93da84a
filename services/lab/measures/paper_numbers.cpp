#include "services/lab/measures/paper_numbers.hpp"

#include <algorithm>
#include <array>

namespace tandem::lab {
namespace {

constexpr std::array<std::string_view, 5> kCodecs{"none", "selective", "quantized", "entropy", "limited"};
constexpr std::array<std::string_view, 4> kMethods{"client-only", "none", "entropy", "limited"};

// A line of tables 5.3 and 5.6; 0 means not measured.
struct Line {
  int scene;
  std::uint32_t bodies;
  double colliding;
  std::array<double, kCodecs.size()> mbit_per_s;
  std::array<double, kMethods.size()> updates_per_s;
};

constexpr std::array<Line, 13> kTable{{
    {1, 5000, 2792, {27.47, 2.41, 0.89, 0.65, 0.65}, {8.9, 19.2, 100.1, 118.1}},
    {1, 10000, 6309, {54.93, 5.26, 1.87, 1.35, 1.20}, {4.4, 8.0, 77.9, 86.7}},
    {1, 20000, 13648, {}, {2.6, 4.6, 40.4, 46.1}},
    {2, 5000, 1635, {27.47, 2.32, 0.89, 0.71, 0.66}, {6.6, 16.4, 107.4, 109.3}},
    {2, 10000, 4771, {54.93, 5.66, 2.07, 1.60, 1.15}, {3.4, 8.5, 73.0, 85.0}},
    {2, 20000, 10973, {}, {2.3, 8.3, 40.0, 43.0}},
    {3, 5000, 3966, {27.47, 7.46, 2.67, 1.86, 1.37}, {2.6, 18.0, 77.2, 77.3}},
    {3, 10000, 8476, {54.93, 15.84, 5.60, 4.00, 1.43}, {1.3, 8.7, 39.1, 41.27}},
    {3, 20000, 17607, {}, {0.9, 4.3, 18.5, 19.1}},
    {4, 5000, 2549, {27.47, 2.07, 0.80, 0.57, 0.57}, {0, 4.2, 68.9, 81.2}},
    {4, 10000, 5676, {54.93, 4.29, 1.62, 1.15, 1.06}, {0, 2.1, 46.2, 60.5}},
    {5, 5000, 4586, {27.47, 9.46, 3.26, 2.23, 1.44}, {0, 3.9, 26.9, 37.2}},
    {5, 10000, 9436, {54.93, 20.07, 6.82, 4.73, 1.45}, {0, 2.1, 18.7, 25.8}},
}};

const Line* line_of(int scene, std::uint32_t bodies) {
  const auto* const line = std::find_if(kTable.begin(), kTable.end(), [&](const Line& candidate) {
    return candidate.scene == scene && candidate.bodies == bodies;
  });
  return line == kTable.end() ? nullptr : line;
}

template <std::size_t N>
std::optional<double> value_of(const std::array<std::string_view, N>& names,
                               const std::array<double, N>& values, std::string_view name) {
  const auto* const column = std::find(names.begin(), names.end(), name);
  if (column == names.end()) return std::nullopt;
  const double value = values[static_cast<std::size_t>(column - names.begin())];
  return value > 0 ? std::optional(value) : std::nullopt;
}

}  // namespace

std::optional<double> paper_mbit_per_s(int scene, std::uint32_t bodies, std::string_view codec) {
  const Line* const line = line_of(scene, bodies);
  return line == nullptr ? std::nullopt : value_of(kCodecs, line->mbit_per_s, codec);
}

std::optional<double> paper_colliding_per_frame(int scene, std::uint32_t bodies) {
  const Line* const line = line_of(scene, bodies);
  return line == nullptr ? std::nullopt : std::optional(line->colliding);
}

std::optional<std::uint32_t> paper_framerate_users(int scene) {
  if (scene < 1 || scene > 5) return std::nullopt;
  return scene < 4 ? 1 : 4;
}

std::optional<double> paper_updates_per_s(int scene, std::uint32_t bodies, std::string_view method) {
  const Line* const line = line_of(scene, bodies);
  return line == nullptr ? std::nullopt : value_of(kMethods, line->updates_per_s, method);
}

}  // namespace tandem::lab
