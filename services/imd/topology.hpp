#pragma once
// What IMD does not say of atoms: their kinds, radii and the box.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::imd {

struct Kind {
  std::string name;
  double radius = 0.5;
  std::uint32_t colour_rgba = 0xC0C0C0FF;
  double mass = 1;
};

/// The atoms in the order of IMD: that of the file, or by their ids in a LAMMPS data file.
struct Topology {
  std::vector<Kind> kinds;
  std::vector<std::uint16_t> kind_of;  ///< of each atom
  std::optional<std::vector<double>> box =
      std::nullopt;  ///< lengths along x, y, z, in the engine's unit of IMD
};

/// Reads a topology, whose form its text shows:
/// - .gro of GROMACS: kinds by the first letter of an atom's name, van der Waals radii; nanometres become
/// Angstrom, as in IMD.
/// - data file of LAMMPS: kinds by type, masses, diameters if the style of `Atoms # style` has them. Styles:
/// atomic, charge,
///   bond, angle, molecular, full, sphere.
/// - lines of our own: `COUNT NAME [RADIUS [RRGGBBAA [MASS]]]`, and `box X Y Z`; `#` begins a comment.
/// `radius`: of atoms that have none there; empty: by the number of atoms in the box, or 0.5.
/// Errors: kMalformed, with the line; kCapacity, more than 4,194,304 atoms or 65,535 kinds.
[[nodiscard]] Result<Topology> parse_topology(std::string_view text, std::optional<double> radius);
/// The same of a file. Errors: also kIo.
[[nodiscard]] Result<Topology> read_topology(const std::string& path, std::optional<double> radius);

}  // namespace tandem::imd
