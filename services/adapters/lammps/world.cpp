// SPDX-License-Identifier: MIT
#include "services/adapters/lammps/world.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "services/adapters/lammps/lammps.hpp"

namespace tandem_lammps {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kRateHz = 30;
constexpr std::int64_t kMaxEvery = 100, kSomeEvery = 10;

template <class T>
T* of_atoms(void* lammps, const char* name) {
  return static_cast<T*>(lammps_extract_atom(lammps, name));
}

}  // namespace

LammpsWorld::LammpsWorld(void* lammps, const Ranks& ranks, const Script& script, const LammpsOptions& options)
    : lammps_(lammps), ranks_(ranks) {
  MPI_Type_contiguous(sizeof(Row), MPI_BYTE, &row_type_);
  MPI_Type_commit(&row_type_);
  if (lammps_extract_setting(lammps_, "box_exist") == 0 || of_atoms<void>(lammps_, "x") == nullptr)
    throw Refusal{"the script comes to its first run without a box"};
  if (of_atoms<void>(lammps_, "id") == nullptr) throw Refusal{"the atoms have no ids (atom_modify id)"};
  read_box();
  const double atoms = ranks_.sum(local());
  choose_pace(options);
  look_at_kinds(script, options);
  bool pours = false;
  for (int type = 1; type <= static_cast<int>(spreads_.size()); ++type)
    pours = pours || script.facts().poured(type);
  const double wanted =
      options.capacity > 0 ? options.capacity : std::max(pours ? 2 * atoms + 10'000 : atoms, 1.0);
  if (wanted > 4194304) throw Refusal{"more than 4194304 atoms"};
  if (wanted < atoms) throw Refusal{"--capacity is smaller than the number of atoms"};
  capacity_ = static_cast<std::uint32_t>(wanted);
}

int LammpsWorld::local() const { return lammps_extract_setting(lammps_, "nlocal"); }

void LammpsWorld::read_box() {
  double xy = 0, yz = 0, xz = 0;
  int periodic[3] = {}, changes = 0;
  lammps_extract_box(lammps_, box_.low.data(), box_.high.data(), &xy, &yz, &xz, periodic, &changes);
  for (std::size_t i = 0; i < 3; ++i) box_.periodic[i] = periodic[i] != 0;
}

void LammpsWorld::choose_pace(const LammpsOptions& options) {
  dt_ = *static_cast<double*>(lammps_extract_global(lammps_, "dt"));
  if (!(dt_ > 0)) throw Refusal{"the script's timestep is not above 0"};
  const auto* const known = static_cast<const char*>(lammps_extract_global(lammps_, "units"));
  const std::string units = known == nullptr ? "" : known;
  const bool seconds = units == "si" || units == "cgs" || units == "lj";
  pace_.every = options.every;
  if (pace_.every == 0) {
    const double real = std::round(1 / ((options.rate_hz > 0 ? options.rate_hz : kRateHz) * dt_));
    pace_.every = seconds ? static_cast<std::int64_t>(std::clamp(real, 1.0, double{kMaxEvery})) : kSomeEvery;
  }
  const double time = dt_ * static_cast<double>(pace_.every);
  const bool same = seconds && options.rate_hz == 0 && time >= 0.5 / kRateHz && time <= 2 / kRateHz;
  pace_.frame_s = same ? time : 1 / (options.rate_hz > 0 ? options.rate_hz : kRateHz);
  pace_.speed = same ? 1 : time / pace_.frame_s;
}

void LammpsWorld::look_at_kinds(const Script& script, const LammpsOptions& options) {
  const int types = lammps_extract_setting(lammps_, "ntypes");
  if (types < 1 || types > static_cast<int>(kMaxTypes))
    throw Refusal{"the script has " + std::to_string(types) + " atom types; 1 to " +
                  std::to_string(kMaxTypes) + " can be shown"};
  const int* const type = of_atoms<int>(lammps_, "type");
  const double* const radius = of_atoms<double>(lammps_, "radius");
  const double* const own_mass = of_atoms<double>(lammps_, "rmass");
  const double* const type_mass = of_atoms<double>(lammps_, "mass");
  const double atoms = std::max(ranks_.sum(local()), 1.0);
  double volume = 1;
  for (std::size_t i = 0; i < 3; ++i) volume *= std::max(box_.length(i), 1e-30);
  const double by_number = std::cbrt(volume / atoms) / 2;
  struct Found {
    double least = kInfinite, most = -kInfinite, mass = 0, count = 0, cubes = 0;
  };
  std::vector<Found> found(static_cast<std::size_t>(types));
  for (int i = 0; i < local(); ++i) {
    Found& of_type = found[static_cast<std::size_t>(std::clamp(type[i], 1, types) - 1)];
    if (radius != nullptr) {
      of_type.least = std::min(of_type.least, radius[i]);
      of_type.most = std::max(of_type.most, radius[i]);
      of_type.cubes += radius[i] * radius[i] * radius[i];
    }
    if (own_mass != nullptr) of_type.mass += own_mass[i];
    of_type.count += 1;
  }
  double worst = 0;
  for (int t = 1; t <= types; ++t) {
    Found& of_type = found[static_cast<std::size_t>(t - 1)];
    double least = ranks_.least(of_type.least), most = ranks_.most(of_type.most);
    const double mass = ranks_.sum(of_type.mass), count = ranks_.sum(of_type.count),
                 cubes = ranks_.sum(of_type.cubes);
    if (const auto poured = script.facts().poured(t); poured && radius != nullptr) {
      least = std::min(least, poured->least);
      most = std::max(most, poured->most);
    }
    if (!(most > 0))
      least = most = options.radius > 0 ? options.radius : script.facts().sigma_radius(t).value_or(by_number);
    least = std::max(least, most * 1e-3);  // points have none
    const Spread spread{.first = static_cast<std::uint32_t>(kinds_.size()),
                        .classes = {least, most, kMaxTypes / static_cast<std::uint32_t>(types)}};
    worst = std::max(worst, spread.classes.error());
    for (std::uint32_t k = 0; k < spread.classes.count(); ++k) {
      const double r = spread.classes.radius(k);
      double each = own_mass == nullptr && type_mass != nullptr ? type_mass[t] : 1;
      if (own_mass != nullptr && count > 0) each = cubes > 0 ? mass * r * r * r / cubes : mass / count;
      kinds_.push_back({.type = t, .radius = r, .mass = each > 0 ? std::clamp(each, 1e-9, 1e9) : 1});
    }
    spreads_.push_back(spread);
  }
  if (ranks_.first() && kinds_.size() > spreads_.size())
    std::printf("radii are shown in %zu sizes, wrong by %.2g %% at most\n", kinds_.size(), 100 * worst);
}

std::uint32_t LammpsWorld::kind_of(int type, double radius) const {
  const Spread& spread = spreads_[std::min(static_cast<std::size_t>(std::max(type, 1)), spreads_.size()) - 1];
  return spread.first + spread.classes.index_of(radius);
}

double LammpsWorld::useful_push() const {
  double smallest = kInfinite;
  for (const Kind& kind : kinds_) smallest = std::min(smallest, kind.radius);
  return 0.1 * smallest / dt_ * pace_.speed;
}

const std::vector<Row>& LammpsWorld::gather() {
  // All of LAMMPS's arrays move with every run.
  double** const x = of_atoms<double*>(lammps_, "x");
  double** const v = of_atoms<double*>(lammps_, "v");
  const int* const type = of_atoms<int>(lammps_, "type");
  const double* const radius = of_atoms<double>(lammps_, "radius");
  const void* const id = of_atoms<void>(lammps_, "id");
  const bool wide = lammps_extract_setting(lammps_, "tagint") == 8;
  const int count = local();
  read_box();
  mine_.resize(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    Row& row = mine_[static_cast<std::size_t>(i)];
    row.id = wide ? static_cast<const std::int64_t*>(id)[i] : static_cast<const int*>(id)[i];
    for (std::size_t d = 0; d < 3; ++d) {
      row.position[d] = static_cast<float>(x[i][d]);
      row.velocity[d] = static_cast<float>(v[i][d] * pace_.speed);
    }
    row.kind = kind_of(type[i], radius == nullptr ? 0 : radius[i]);
    row.unused = 0;
  }
  std::vector<int> counts(static_cast<std::size_t>(ranks_.count())), offsets(counts.size());
  MPI_Gather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, ranks_.comm());
  int sum = 0;
  for (std::size_t i = 0; i < counts.size() && ranks_.first(); ++i) {
    offsets[i] = sum;
    sum += counts[i];
  }
  all_.resize(static_cast<std::size_t>(sum));
  MPI_Gatherv(mine_.data(), count, row_type_, all_.data(), counts.data(), offsets.data(), row_type_, 0,
              ranks_.comm());
  return all_;
}

void LammpsWorld::push(const Vec3& centre, double radius, const Vec3& change) {
  double** const x = of_atoms<double*>(lammps_, "x");
  double** const v = of_atoms<double*>(lammps_, "v");
  for (int i = 0; i < local(); ++i) {
    double squared = 0;
    for (std::size_t d = 0; d < 3; ++d) {
      const double apart = x[i][d] - centre[d];
      squared += apart * apart;
    }
    if (squared > radius * radius) continue;
    for (std::size_t d = 0; d < 3; ++d) v[i][d] += change[d] / pace_.speed;
  }
}

}  // namespace tandem_lammps
