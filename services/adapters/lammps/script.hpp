// SPDX-License-Identifier: MIT
#pragma once
// A LAMMPS script whose runs can be made a few steps at a time.

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "services/adapters/lammps/facts.hpp"
#include "services/adapters/lammps/ranks.hpp"
#include "services/adapters/lammps/recorded.hpp"

namespace tandem_lammps {

/// A script's wish that the server cannot stream; for people.
struct Refusal {
  std::string why;
};

/// Reads a script line by line and has LAMMPS split each line into words, so that quotes, comments and
/// variables mean what they mean there. LAMMPS executes the line, but for what decides which line is the next
/// one (`include`, `jump`, `label`, `if`, `quit`) and for `run`. `rerun` and `minimize` are made at once. All
/// ranks call all functions alike. Throws Refusal, also for an error of LAMMPS, which Debian builds so that
/// it ends the program itself.
class Script {
 public:
  Script(void* lammps, const Ranks& ranks, const std::string& file);

  /// Makes this many steps of its runs, with the commands between them. Gives the steps made: fewer at the
  /// end.
  std::int64_t advance(std::int64_t steps);
  /// Goes on until the first step of a run can be made. False: the script is over.
  bool reach_run();
  /// It came to a run, if only one of 0 steps.
  [[nodiscard]] bool ran() const { return ran_; }
  /// Goes on with the last run for ever, instead of ending.
  void make_endless() { endless_ = true; }

  [[nodiscard]] const Facts& facts() const { return facts_; }
  /// A gravity that turn_gravity() turns.
  [[nodiscard]] const std::optional<Gravity>& gravity() const { return gravity_; }
  /// Acts in the next step. In the script's units.
  void turn_gravity(const Vec3& value);
  [[nodiscard]] const Vec3& gravity_now() const { return gravity_now_; }

  /// A number that is the same for the same script, whatever has been executed of it.
  [[nodiscard]] std::uint64_t fingerprint() const { return fingerprint_; }
  /// Writes a restart file of LAMMPS.
  void write_restart(const std::string& file);
  /// Lines that bring another LAMMPS to where this one is, beside the restart file.
  [[nodiscard]] std::string save() const;
  /// Clears LAMMPS, reads the restart file and executes what save() gave.
  void load(const std::string& saved, const std::string& restart_file);

 private:
  struct Place {
    std::string file;
    std::size_t line = 0;  // the next one
  };
  struct Run {
    std::int64_t left = 0, start = 0, stop = 0;
  };
  void* command(const std::string& line);
  const std::vector<std::string>& lines_of(const std::string& file);
  void open(const std::string& file);
  bool next_line(std::string& line);
  Words words_of(const std::string& line);
  void execute(const std::string& line);
  void jump(const Words& words);
  void branch(const Words& words);
  void begin_run(const Words& words);
  bool take_gravity(const Words& words);
  void give_gravity_back();
  void refresh();
  Words without_the_uncertain(const Words& thermo_style);
  void set_loop(const Words& words, const std::string& value);
  [[nodiscard]] const char* value_of(const std::string& variable) const;
  [[nodiscard]] std::int64_t step_now() const;
  [[nodiscard]] bool skips();
  bool loop_has_ended();

  void* lammps_;
  const Ranks& ranks_;
  std::map<std::string, std::vector<std::string>> files_ = {};
  std::vector<Place> places_ = {};      // of nested includes, the innermost last
  std::deque<std::string> first_ = {};  // lines that come before the next one of the file
  bool skip_jump_ = false;              // a `next` ended its loop
  bool fewer_columns_ = false;          // than thermo_style says
  Run run_ = {};
  bool endless_ = false, needs_setup_ = true, ran_ = false;
  Facts facts_ = {};
  std::optional<Gravity> gravity_ = {};
  Vec3 gravity_now_{};
  Recorded recorded_ = {};
  std::uint64_t fingerprint_ = 0;
};

}  // namespace tandem_lammps
