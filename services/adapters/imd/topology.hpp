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
      std::nullopt;       ///< lengths along x, y, z, in the engine's unit of IMD
  std::string note = {};  ///< for people: what was simplified; empty if nothing was
};

/// Reads a topology, whose form its text shows:
/// - .gro of GROMACS, .pdb, .xyz: kinds by element, which a .gro shows by the first letter of an atom's name;
/// van der
///   Waals radii. Nanometres of a .gro become Angstrom, as in IMD.
/// - data file of LAMMPS: kinds by type, masses, labels; diameters if the style is sphere. The style stands
/// in `Atoms #
///   style`, or is the only one of atomic, charge, molecular, full and sphere that all lines fit.
/// - lines of our own: `COUNT NAME [RADIUS [RRGGBBAA [MASS]]]`, and `box X Y Z`; `#` begins a comment.
/// At most 800 kinds come out of it: if there are more radii, they become classes, and `note` says by how
/// much radii are wrong. `radius`: of atoms that have none there; empty: by the number of atoms in the box,
/// or 0.5. Errors: kMalformed, with the line; kCapacity, more than 4,194,304 atoms or 800 kinds besides their
/// radii.
[[nodiscard]] Result<Topology> parse_topology(std::string_view text, std::optional<double> radius);
/// The same of a file, which may be compressed by gzip. Errors: also kIo; kCapacity, more than 1 GiB.
[[nodiscard]] Result<Topology> read_topology(const std::string& path, std::optional<double> radius);

}  // namespace tandem::imd
