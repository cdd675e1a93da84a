#include "services/adapters/imd/kinds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "services/adapters/lammps/radii.hpp"

namespace tandem::imd {
namespace {

using tandem_lammps::kMaxTypes;
using tandem_lammps::RadiusClasses;

// Okabe and Ito's colours, which most people can tell apart.
constexpr std::array<std::uint32_t, 7> kColours{0xE69F00FF, 0x56B4E9FF, 0x009E73FF, 0xF0E442FF,
                                                0x0072B2FF, 0xD55E00FF, 0xCC79A7FF};

constexpr std::array<Element, 24> kElements{
    {{"H", 1.2, 0xF0F0F0FF, 1.008},    {"He", 1.4, 0xD9FFFFFF, 4.003},   {"Li", 1.82, 0xCC80FFFF, 6.94},
     {"C", 1.7, 0x707070FF, 12.011},   {"N", 1.55, 0x3050F8FF, 14.007},  {"O", 1.52, 0xE03020FF, 15.999},
     {"F", 1.47, 0x90E050FF, 18.998},  {"Ne", 1.54, 0xB3E3F5FF, 20.18},  {"Na", 2.27, 0xAB5CF2FF, 22.99},
     {"Mg", 1.73, 0x8AFF00FF, 24.305}, {"Al", 2.25, 0xBFA6A6FF, 26.982}, {"Si", 2.1, 0xF0C8A0FF, 28.085},
     {"P", 1.8, 0xF08000FF, 30.974},   {"S", 1.8, 0xE0C030FF, 32.06},    {"Cl", 1.75, 0x1FF01FFF, 35.45},
     {"Ar", 1.88, 0x80D1E3FF, 39.95},  {"K", 2.75, 0x8F40D4FF, 39.098},  {"Ca", 2.62, 0x3DFF00FF, 40.078},
     {"Fe", 2.44, 0xE06633FF, 55.845}, {"Ni", 1.63, 0x50D050FF, 58.693}, {"Cu", 1.4, 0xC88033FF, 63.546},
     {"Zn", 1.39, 0x7D80B0FF, 65.38},  {"Br", 1.85, 0xA62929FF, 79.904}, {"I", 1.98, 0x940094FF, 126.904}}};

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }

}  // namespace

const Element* element_of(std::string_view symbol) {
  const auto found = std::ranges::find_if(
      kElements, [&](const Element& e) { return std::ranges::equal(e.symbol, symbol, {}, lower, lower); });
  return found == kElements.end() ? nullptr : &*found;
}

std::uint32_t Kinds::group(std::string_view name, double mass, std::optional<std::uint32_t> colour) {
  const auto found = std::ranges::find_if(groups_, [&](const Kind& kind) {
    return kind.name == name && kind.mass == mass && (!colour || kind.colour_rgba == *colour);
  });
  if (found != groups_.end()) return static_cast<std::uint32_t>(found - groups_.begin());
  // One more than fits is enough to refuse them, and the search stays short.
  if (groups_.size() <= kMaxTypes)
    groups_.push_back({.name = std::string(name),
                       .colour_rgba = colour.value_or(kColours[groups_.size() % kColours.size()]),
                       .mass = mass});
  return static_cast<std::uint32_t>(groups_.size() - 1);
}

void Kinds::add_element(std::string_view symbol, std::optional<double> radius) {
  const Element* const element = element_of(symbol);
  if (element != nullptr)
    return add(group(element->symbol, element->mass, element->colour), radius.value_or(element->radius));
  add(group(symbol, 20), radius.value_or(1.5));
}

void Kinds::add(std::uint32_t group, double radius, std::size_t count) {
  atoms_ += std::min(count, kMaxAtoms + 1);
  if (atoms_ > kMaxAtoms) return;
  if (!rows_.empty() && rows_.back().group == group && rows_.back().radius == radius) {
    rows_.back().count += count;
  } else {
    rows_.push_back({group, radius, count});
  }
}

Result<Topology> Kinds::finish(std::optional<std::vector<double>> box) const {
  if (atoms_ == 0) return fail(ErrorCode::kMalformed, "it has no atoms");
  if (atoms_ > kMaxAtoms) return fail(ErrorCode::kCapacity, fmt::format("more than {} atoms", kMaxAtoms));
  if (groups_.size() > kMaxTypes)
    return fail(
        ErrorCode::kCapacity,
        fmt::format("more than {} kinds of atoms besides their radii: give some the same name", kMaxTypes));
  Topology topology{.kinds = {}, .kind_of = {}, .box = std::move(box), .note = {}};
  topology.kind_of.reserve(atoms_);
  std::map<std::pair<std::uint32_t, double>, std::uint16_t> exact;
  for (const Row& row : rows_) {
    if (exact.size() <= kMaxTypes) exact.try_emplace({row.group, row.radius}, std::uint16_t{0});
  }
  const auto put = [&](const Row& row, std::size_t kind) {
    topology.kind_of.insert(topology.kind_of.end(), row.count, static_cast<std::uint16_t>(kind));
  };
  const auto make = [&](std::uint32_t group, double radius) {
    topology.kinds.push_back(groups_[group]);
    topology.kinds.back().radius = radius;
    return static_cast<std::uint16_t>(topology.kinds.size() - 1);
  };
  if (exact.size() <= kMaxTypes) {
    exact.clear();
    for (const Row& row : rows_) {
      const auto [at, is_new] = exact.try_emplace({row.group, row.radius}, std::uint16_t{0});
      if (is_new) at->second = make(row.group, row.radius);
      put(row, at->second);
    }
    return topology;
  }
  std::vector<std::pair<double, double>> ranges(groups_.size(), {1e300, 0});
  for (const Row& row : rows_) {
    auto& [least, most] = ranges[row.group];
    least = std::min(least, row.radius);
    most = std::max(most, row.radius);
  }
  std::vector<RadiusClasses> classes;
  std::vector<std::size_t> first;
  double worst = 0;
  for (std::uint32_t g = 0; g < groups_.size(); ++g) {
    classes.emplace_back(std::min(ranges[g].first, ranges[g].second), ranges[g].second,
                         kMaxTypes / static_cast<std::uint32_t>(groups_.size()));
    first.push_back(topology.kinds.size());
    worst = std::max(worst, classes[g].error());
    for (std::uint32_t k = 0; k < classes[g].count(); ++k) make(g, classes[g].radius(k));
  }
  for (const Row& row : rows_) put(row, first[row.group] + classes[row.group].index_of(row.radius));
  topology.note = fmt::format("radii are shown in {} sizes, wrong by {:.2g} % at most", topology.kinds.size(),
                              100 * worst);
  return topology;
}

}  // namespace tandem::imd
