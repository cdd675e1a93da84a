#pragma once
// Which kinds of atoms a topology has, as few enough that a HELLO has room for them.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "services/adapters/imd/topology.hpp"

namespace tandem::imd {

constexpr std::size_t kMaxAtoms = 4'194'304;

/// Van der Waals radii (A. Bondi, 1964; S. Alvarez, 2013, for metals) and the usual colours of elements.
struct Element {
  std::string_view symbol;
  double radius;
  std::uint32_t colour;
  double mass;
};
/// By its symbol in letters of any size; null if it is not known.
[[nodiscard]] const Element* element_of(std::string_view symbol);

/// Collects the atoms of a topology in their order. Atoms of a group differ in radius alone.
class Kinds {
 public:
  /// The group of that name; a new one has the next of a few colours if none is given.
  std::uint32_t group(std::string_view name, double mass = 1, std::optional<std::uint32_t> colour = {});
  /// The group of an element, and its radius unless another one is given.
  void add_element(std::string_view symbol, std::optional<double> radius);
  void add(std::uint32_t group, double radius, std::size_t count = 1);
  [[nodiscard]] std::size_t atoms() const { return atoms_; }

  /// A kind for each pair of group and radius; if these are too many, radii become classes. Errors:
  /// kCapacity, too many groups or atoms; kMalformed, no atoms.
  [[nodiscard]] Result<Topology> finish(std::optional<std::vector<double>> box) const;

 private:
  struct Row {
    std::uint32_t group;
    double radius;
    std::size_t count;
  };
  std::vector<Kind> groups_ = {};
  std::vector<Row> rows_ = {};
  std::size_t atoms_ = 0;
};

}  // namespace tandem::imd
