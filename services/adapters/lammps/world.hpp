// SPDX-License-Identifier: MIT
#pragma once
// The atoms of all ranks: what they are, where they are, and what users do to them.

#include <cstdint>
#include <vector>

#include "services/adapters/lammps/facts.hpp"
#include "services/adapters/lammps/options.hpp"
#include "services/adapters/lammps/radii.hpp"
#include "services/adapters/lammps/ranks.hpp"
#include "services/adapters/lammps/script.hpp"

namespace tandem_lammps {

/// What viewers see of a kind of atoms.
struct Kind {
  int type = 1;  ///< LAMMPS's
  double radius = 0, mass = 0;
};

/// Time of the script against time of the viewers.
struct Pace {
  std::int64_t every = 0;  ///< steps of a frame
  double frame_s = 0;      ///< of viewers
  double speed = 1;        ///< script's time that passes in a second of viewers
};

/// An atom on its way to the first rank.
struct Row {
  std::int64_t id;
  float position[3], velocity[3];  // velocity: per time of viewers
  std::uint32_t kind;
  std::uint32_t unused;
};

/// The first rank has the results of gather(); all ranks call all functions alike.
class LammpsWorld {
 public:
  /// Looks at the atoms as they are at the script's first run. Throws Refusal.
  LammpsWorld(void* lammps, const Ranks& ranks, const Script& script, const LammpsOptions& options);

  [[nodiscard]] const std::vector<Kind>& kinds() const { return kinds_; }
  [[nodiscard]] const Pace& pace() const { return pace_; }
  [[nodiscard]] const Box& box() const { return box_; }
  [[nodiscard]] std::uint32_t capacity() const { return capacity_; }
  /// The largest useful change of velocity, per time of viewers: a tenth of the smallest radius in a step of
  /// LAMMPS.
  [[nodiscard]] double useful_push() const;

  /// Brings the atoms of all ranks to the first one. One MPI_Gather of numbers, one MPI_Gatherv.
  const std::vector<Row>& gather();
  /// Adds to the velocity, per time of viewers, of all atoms within the radius.
  void push(const Vec3& centre, double radius, const Vec3& change);

 private:
  void look_at_kinds(const Script& script, const LammpsOptions& options);
  void choose_pace(const LammpsOptions& options);
  [[nodiscard]] std::uint32_t kind_of(int type, double radius) const;
  void read_box();
  [[nodiscard]] int local() const;

  struct Spread {
    std::uint32_t first = 0;  // its kinds begin here
    RadiusClasses classes;
  };
  void* lammps_;
  const Ranks& ranks_;
  std::vector<Kind> kinds_ = {};
  std::vector<Spread> spreads_ = {};  // by type - 1
  Pace pace_ = {};
  Box box_ = {};
  double dt_ = 0;
  std::uint32_t capacity_ = 0;
  std::vector<Row> mine_ = {}, all_ = {};
  MPI_Datatype row_type_ = MPI_DATATYPE_NULL;
};

}  // namespace tandem_lammps
