// SPDX-License-Identifier: MIT
#include "services/adapters/lammps/facts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace tandem_lammps {
namespace {

constexpr double kRadPerDegree = 3.14159265358979323846 / 180;

Plane plane(std::size_t axis, bool low, std::optional<double> at) {
  Plane made;
  made.normal[axis] = low ? 1 : -1;
  if (at) made.offset = low ? *at : -*at;
  return made;
}

/// The values behind `word`, if all of them are numbers.
std::vector<double> numbers_behind(const Words& words, const std::string& word, std::size_t count) {
  const auto found = std::find(words.begin(), words.end(), word);
  std::vector<double> values;
  for (std::size_t i = 1; i <= count && static_cast<std::size_t>(words.end() - found) > i; ++i)
    if (const auto value = number(*(found + static_cast<std::ptrdiff_t>(i)))) values.push_back(*value);
  return values.size() == count ? values : std::vector<double>();
}

}  // namespace

bool holds(const Words& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::optional<double> number(const std::string& word) {
  char* end = nullptr;
  const double value = std::strtod(word.c_str(), &end);
  if (word.empty() || *end != 0 || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<Gravity> Facts::gravity_of(const Words& words, bool is_2d) {
  if (words.size() < 6 || words[0] != "fix" || words[3] != "gravity") return std::nullopt;
  const auto strength = number(words[4]);
  if (!strength) return std::nullopt;
  Vec3 direction{};
  if (words[5] == "vector") {
    const auto values = numbers_behind(words, "vector", 3);
    if (values.empty()) return std::nullopt;
    std::copy(values.begin(), values.end(), direction.begin());
  } else if (words[5] == "chute") {
    const auto values = numbers_behind(words, "chute", 1);
    if (values.empty()) return std::nullopt;
    const double vert = values[0] * kRadPerDegree;
    direction = is_2d ? Vec3{std::sin(vert), -std::cos(vert), 0} : Vec3{std::sin(vert), 0, -std::cos(vert)};
  } else if (words[5] == "spherical") {
    const auto values = numbers_behind(words, "spherical", 2);
    if (values.empty()) return std::nullopt;
    const double phi = values[0] * kRadPerDegree, theta = values[1] * kRadPerDegree;
    direction = is_2d
                    ? Vec3{std::cos(theta), std::sin(theta), 0}
                    : Vec3{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
  } else {
    return std::nullopt;
  }
  const double length = std::hypot(direction[0], direction[1], direction[2]);
  if (!(length > 0)) return std::nullopt;
  Gravity gravity{.fix = words[1], .group = words[2], .words = words, .value = {}};
  for (std::size_t i = 0; i < 3; ++i) gravity.value[i] = *strength * direction[i] / length;
  return gravity;
}

void Facts::learn(const Words& words) {
  if (words.empty()) return;
  const std::string& command = words[0];
  if (command == "clear") return forget_all();
  if (command == "fix" && words.size() > 3) return learn_fix(words);
  if (command == "unfix" && words.size() > 1) {
    walls_.erase(words[1]);
    pours_.erase(words[1]);
  } else if (command == "region" && words.size() > 3) {
    learn_region(words);
  } else if (command == "run_style" && words.size() > 1) {
    respa_ = words[1].starts_with("respa");
  } else if (command == "thermo_modify") {
    says_lost_ = says_lost_ || std::find(words.begin(), words.end(), "lost") != words.end();
  } else if (command == "pair_style" && words.size() > 1) {
    lennard_jones_ = words[1].starts_with("lj/");
    law_.reset();
    if (!words[1].starts_with("gran/hooke") || words.size() < 7) return;
    const auto spring = number(words[2]), damping = number(words[4]), shear = number(words[5]);
    // NULL: half of the normal one.
    if (spring && damping && !words[1].starts_with("gran/hooke/history"))
      law_ = Law{.spring = *spring, .damping = *damping, .shear = shear.value_or(*damping / 2)};
  } else if (command == "pair_coeff" && words.size() > 4 && lennard_jones_) {
    const auto first = number(words[1]), sigma = number(words[4]);
    if (first && words[1] == words[2] && sigma) sigmas_[static_cast<int>(*first)] = *sigma / 2;
    if (words[1] == "*" && words[2] == "*" && sigma) sigmas_[0] = *sigma / 2;
  }
}

void Facts::learn_fix(const Words& words) {
  const std::string &fix = words[1], &style = words[3];
  walls_.erase(fix);
  pours_.erase(fix);
  if (style == "pour" || style == "deposit") {
    const auto type = words.size() > 5 ? number(words[5]) : std::nullopt;
    if (!type) return;
    if (style == "pour") pours_[fix] = static_cast<int>(*type);
    // What it has inserted so far is in no restart file, and LAMMPS ends with an error or a signal.
    if (style == "pour" && std::find(words.begin(), words.end(), "mol") != words.end())
      no_checkpoints_ = "fix pour with mol";
    const auto found = std::find(words.begin(), words.end(), "diam");
    std::vector<double> diameters{1};  // without a word
    const std::string kind = words.end() - found < 3 ? "" : *(found + 1);
    if (kind == "one") diameters = numbers_behind(words, "one", 1);
    if (kind == "range") diameters = numbers_behind(words, "range", 2);
    if (kind == "poly") {
      const auto count = number(*(found + 2));
      const auto pairs = !count || *count < 0 || *count > 1000
                             ? std::vector<double>()
                             : numbers_behind(words, "poly", 1 + 2 * static_cast<std::size_t>(*count));
      diameters.clear();
      for (std::size_t i = 1; i < pairs.size(); i += 2) diameters.push_back(pairs[i]);
    }
    if (diameters.empty()) return;
    const auto [least, most] = std::minmax_element(diameters.begin(), diameters.end());
    poured_[static_cast<int>(*type)] = {.least = *least / 2, .most = *most / 2};
    return;
  }
  if (!style.starts_with("wall/")) return;
  Region wall;
  for (std::size_t i = 4; i < words.size(); ++i) {
    const std::string& word = words[i];
    const std::size_t axis = word.empty() ? 3 : static_cast<std::size_t>(word[0] - 'x');
    if (axis < 3 && word.compare(1, std::string::npos, "plane") == 0 && i + 2 < words.size()) {
      if (const auto at = number(words[i + 1])) wall.planes.push_back(plane(axis, true, at));
      if (const auto at = number(words[i + 2])) wall.planes.push_back(plane(axis, false, at));
    } else if (axis < 3 && (word.substr(1) == "lo" || word.substr(1) == "hi") && i + 1 < words.size()) {
      if (const auto at = number(words[i + 1]); at || words[i + 1] == "EDGE")
        wall.planes.push_back(plane(axis, word.substr(1) == "lo", at));
    } else if (style.find("region") != std::string::npos && regions_.count(word) != 0) {
      wall = regions_[word];
    }
  }
  walls_[fix] = wall;
}

void Facts::learn_region(const Words& words) {
  const std::string& style = words[2];
  const auto side = std::find(words.begin(), words.end(), "side");
  const bool outside = words.end() - side > 1 && *(side + 1) == "out";
  Region region;
  if (style == "block" && !outside && words.size() > 8) {
    for (std::size_t i = 0; i < 6; ++i) {
      const auto at = number(words[3 + i]);
      if (at || words[3 + i] == "EDGE") region.planes.push_back(plane(i / 2, i % 2 == 0, at));
    }
  } else if (style == "plane") {
    const auto v = numbers_behind(words, "plane", 6);
    const double length = v.empty() ? 0 : std::hypot(v[3], v[4], v[5]);
    if (!(length > 0)) return;
    const double sign = (outside ? -1 : 1) / length;
    const Vec3 normal{sign * v[3], sign * v[4], sign * v[5]};
    region.planes.push_back(
        {.normal = normal, .offset = normal[0] * v[0] + normal[1] * v[1] + normal[2] * v[2]});
  } else if (style == "sphere" && outside) {
    const auto v = numbers_behind(words, "sphere", 4);
    if (!v.empty()) region.ball = {v[0], v[1], v[2], v[3]};
  } else {
    return;
  }
  regions_[words[1]] = region;
}

std::vector<Plane> Facts::planes(const Box& box) const {
  std::vector<Plane> all;
  for (const auto& [fix, wall] : walls_) {
    for (Plane plane : wall.planes) {
      for (std::size_t i = 0; i < 3 && !plane.offset; ++i) {
        if (plane.normal[i] > 0) plane.offset = box.low[i];
        if (plane.normal[i] < 0) plane.offset = -box.high[i];
      }
      all.push_back(plane);
    }
  }
  return all;
}

std::vector<std::array<double, 4>> Facts::balls() const {
  std::vector<std::array<double, 4>> all;
  for (const auto& [fix, wall] : walls_)
    if (wall.ball) all.push_back(*wall.ball);
  return all;
}

std::optional<Radii> Facts::poured(int type) const {
  const auto found = poured_.find(type);
  return found == poured_.end() ? std::nullopt : std::optional(found->second);
}

std::optional<double> Facts::sigma_radius(int type) const {
  auto found = sigmas_.find(type);
  if (found == sigmas_.end()) found = sigmas_.find(0);
  if (found == sigmas_.end()) return std::nullopt;
  if (found->second > 0) return found->second;
  // The hydrogen of water has none: it is half of the smallest other one.
  std::optional<double> smallest;
  for (const auto& [key, radius] : sigmas_)
    if (radius > 0) smallest = std::min(radius, smallest.value_or(radius));
  return smallest ? std::optional(*smallest / 2) : std::nullopt;
}

}  // namespace tandem_lammps
