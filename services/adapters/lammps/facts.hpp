// SPDX-License-Identifier: MIT
#pragma once
// What a script says of its world beside the atoms: gravity, walls, the law of contacts, radii of atoms to
// come.

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tandem_lammps {

using Vec3 = std::array<double, 3>;
using Words = std::vector<std::string>;

struct Box {
  Vec3 low{}, high{};
  std::array<bool, 3> periodic{};
  [[nodiscard]] double length(std::size_t axis) const { return high[axis] - low[axis]; }
};

/// dot(normal, p) >= offset on the atoms' side. Without an offset it is at the edge of the box.
struct Plane {
  Vec3 normal{};
  std::optional<double> offset = {};
};

/// A constant force on all atoms that users may turn.
struct Gravity {
  std::string fix, group;
  Words words;   ///< as the script has it
  Vec3 value{};  ///< of the script
};

/// LAMMPS's `gran/hooke`: force = spring * overlap, damped by mass * damping.
struct Law {
  double spring = 0, damping = 0, shear = 0;
};

struct Radii {
  double least = 0, most = 0;
};

/// Learns from commands as they are executed. It knows the common forms and ignores all others. Pure.
class Facts {
 public:
  /// A command whose variables are replaced.
  void learn(const Words& words);
  void forget_all() { *this = Facts(); }

  /// A gravity that can be turned, if this command makes one; see `fix gravity`.
  [[nodiscard]] static std::optional<Gravity> gravity_of(const Words& words, bool is_2d);

  [[nodiscard]] std::vector<Plane> planes(const Box& box) const;
  [[nodiscard]] std::vector<std::array<double, 4>> balls() const;  ///< centre, radius
  [[nodiscard]] std::optional<Law> law() const { return law_; }
  /// Radii of atoms of a type that are poured later.
  [[nodiscard]] std::optional<Radii> poured(int type) const;
  /// Half of the sigma of a Lennard-Jones type; if that is 0, half of the smallest other one.
  [[nodiscard]] std::optional<double> sigma_radius(int type) const;
  /// `fix pour` refuses a gravity that may change.
  [[nodiscard]] bool pours() const { return !pours_.empty(); }
  [[nodiscard]] bool says_lost() const { return says_lost_; }
  /// r-RESPA makes no part of a run without its setup.
  [[nodiscard]] bool always_sets_up() const { return respa_; }
  /// Why no other LAMMPS can go on from a restart file; empty if one can.
  [[nodiscard]] const std::string& no_checkpoints() const { return no_checkpoints_; }

 private:
  struct Region {
    std::vector<Plane> planes = {};
    std::optional<std::array<double, 4>> ball = {};
  };
  void learn_fix(const Words& words);
  void learn_region(const Words& words);

  std::map<std::string, Region> regions_ = {};
  std::map<std::string, Region> walls_ = {};  // by fix
  std::map<std::string, int> pours_ = {};     // type by fix
  std::map<int, Radii> poured_ = {};
  std::map<int, double> sigmas_ = {};
  std::optional<Law> law_ = {};
  bool lennard_jones_ = false;
  bool says_lost_ = false, respa_ = false;
  std::string no_checkpoints_ = {};
};

[[nodiscard]] bool holds(const Words& words, const std::string& word);
/// A number, or nothing.
[[nodiscard]] std::optional<double> number(const std::string& word);

}  // namespace tandem_lammps
