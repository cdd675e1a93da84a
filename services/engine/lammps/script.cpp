// SPDX-License-Identifier: MIT
#include "services/engine/lammps/script.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "services/engine/lammps/lammps.hpp"

namespace tandem_lammps {
namespace {

// Commands that a world needs again after its atoms came from a restart file, those of the first line before
// them.
const Words kBeforeAtoms{"atom_modify", "newton", "package", "processors", "suffix"};
const Words kAfterAtoms{
    "angle_coeff",    "angle_style",    "balance",        "bond_coeff",     "bond_style",
    "comm_modify",    "comm_style",     "compute",        "compute_modify", "dielectric",
    "dihedral_coeff", "dihedral_style", "dump",           "dump_modify",    "fix",
    "fix_modify",     "group",          "improper_coeff", "improper_style", "kspace_modify",
    "kspace_style",   "lattice",        "mass",           "neigh_modify",   "neighbor",
    "pair_coeff",     "pair_modify",    "pair_style",     "region",         "restart",
    "run_style",      "special_bonds",  "thermo",         "thermo_modify",  "thermo_style",
    "timestep",       "uncompute",      "undump",         "unfix",          "variable"};

bool holds(const Words& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::string joined(const Words& words) {
  std::string line;
  for (const std::string& word : words) {
    const bool plain = !word.empty() && word.find_first_of(" \t\"'#&\n") == std::string::npos;
    const char* const mark = plain ? "" : word.find('"') == std::string::npos ? "\"" : "\"\"\"";
    line += (line.empty() ? "" : " ") + (mark + word) + mark;
  }
  return line;
}

std::string exact(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

}  // namespace

Script::Script(void* lammps, const Ranks& ranks, const std::string& file) : lammps_(lammps), ranks_(ranks) {
  open(file);
  fingerprint_ = 1469598103934665603ULL;  // FNV-1a
  for (const std::string& line : lines_of(file))
    for (const char c : line + '\n')
      fingerprint_ = (fingerprint_ ^ static_cast<std::uint8_t>(c)) * 1099511628211ULL;
}

void* Script::command(const std::string& line) {
  void* const name = lammps_command(lammps_, line.c_str());
  // Debian's LAMMPS has ended the program by now; one that throws comes back.
  if (lammps_has_error(lammps_) == 0) return name;
  char text[512] = "LAMMPS says no more";
  const bool of_all = lammps_get_last_error_message(lammps_, text, sizeof text) == 1;
  if (!of_all) {  // the other ranks know nothing of it
    std::fprintf(stderr, "tandem-lammps: %s\n", text);
    MPI_Abort(ranks_.comm(), 1);
  }
  throw Refusal{std::string(text) + " (" + line + ")"};
}

std::int64_t Script::step_now() const {
  return lammps_extract_setting(lammps_, "bigint") == 8
             ? *static_cast<std::int64_t*>(lammps_extract_global(lammps_, "ntimestep"))
             : *static_cast<int*>(lammps_extract_global(lammps_, "ntimestep"));
}

// Files

const std::vector<std::string>& Script::lines_of(const std::string& file) {
  if (const auto known = files_.find(file); known != files_.end()) return known->second;
  std::string text;
  if (ranks_.first()) {
    std::ifstream in(file, std::ios::binary);
    std::ostringstream all;
    all << in.rdbuf();
    text = in ? '+' + all.str() : "-";
  }
  ranks_.share(text);
  if (text.empty() || text[0] == '-') throw Refusal{file + ": cannot be read"};
  std::vector<std::string> lines;
  std::istringstream stream(text.substr(1));
  bool quoted = false;
  for (std::string line; std::getline(stream, line);) {
    while (!line.empty() && (std::isspace(static_cast<unsigned char>(line.back())) != 0)) line.pop_back();
    // A line goes on behind '&' and within triple quotes.
    const bool follows = !lines.empty() && (quoted || (!lines.back().empty() && lines.back().back() == '&'));
    if (follows && !quoted) lines.back().back() = ' ';
    if (follows && quoted) lines.back() += '\n';
    for (std::size_t at = line.find("\"\"\""); at != std::string::npos; at = line.find("\"\"\"", at + 3))
      quoted = !quoted;
    if (follows) {
      lines.back() += line;
    } else {
      lines.push_back(line);
    }
  }
  return files_[file] = std::move(lines);
}

void Script::open(const std::string& file) {
  constexpr std::size_t kDeepest = 32;
  if (places_.size() == kDeepest) throw Refusal{file + ": scripts are nested too deep"};
  lines_of(file);
  places_.push_back({.file = file, .line = 0});
}

bool Script::next_line(std::string& line) {
  while (!places_.empty()) {
    Place& place = places_.back();
    const std::vector<std::string>& lines = lines_of(place.file);
    if (place.line < lines.size()) {
      line = lines[place.line++];
      return true;
    }
    if (places_.size() == 1) return false;  // load() may set it back
    places_.pop_back();
  }
  return false;
}

// Commands

bool Script::skips() { return command("variable tandem_probe string x") == nullptr; }

Words Script::expand(const std::string& line) {
  if (line.find('$') == std::string::npos) return split(line);
  // LAMMPS replaces variables by its own rules; the words are then the values of a variable of its own.
  command("variable tandem_words delete");
  command("variable tandem_words index " + line.substr(0, line.find('#')) + " tandem_end");
  Words words;
  for (;;) {
    const auto* word = static_cast<const char*>(lammps_extract_variable(lammps_, "tandem_words", nullptr));
    if (word == nullptr || std::string(word) == "tandem_end") return words;
    words.emplace_back(word);
    command("next tandem_words");
  }
}

void Script::execute(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(" \t");
  if (begin == std::string::npos || line[begin] == '#') return;
  const std::string name = line.substr(begin, line.find_first_of(" \t#", begin) - begin);
  static const Words kRead{"fix", "include", "jump", "pair_coeff", "pair_style", "region", "run", "unfix"};
  Words words;
  if (holds(kRead, name)) {
    words = expand(line);
  } else if (line.find('$') == std::string::npos) {
    words = split(line);
  }
  if (name == "label") return;
  if (name == "include" && words.size() > 1) return open(words[1]);
  if (name == "jump") return jump(words);
  if (name == "if") return branch(line);
  if (name == "run") return begin_run(words, line);
  if (name == "quit") {
    places_.resize(1);
    places_[0].line = lines_of(places_[0].file).size();
    return;
  }
  if (name == "clear") {
    recorded_.clear();
    gravity_.reset();
    needs_setup_ = true;
  }
  // `fix pour` checks the gravity while it is made.
  if (name == "fix" && words.size() > 3 && words[3] == "pour") give_gravity_back();
  if (!take_gravity(words)) {
    // A variable that is replaced once may be random: LAMMPS gets what was read here.
    const std::string now = holds(kRead, name) && line.find('$') != std::string::npos ? joined(words) : line;
    command(now);
    record(name, now, words);
  }
  facts_.learn(words);
  needs_setup_ = true;
}

void Script::record(const std::string& name, const std::string& line, const Words& words) {
  if (!holds(kBeforeAtoms, name) && !holds(kAfterAtoms, name)) return;
  // Members of other groups are in the restart file.
  if (name == "group" && !(words.size() > 2 && words[2] == "dynamic")) return;
  recorded_.push_back(line);
}

void Script::go_to(const std::string& file, const std::string& label) {
  Place& place = places_.back();
  if (file != "SELF") place.file = file;
  place.line = 0;
  if (label.empty()) return;
  const std::vector<std::string>& lines = lines_of(place.file);
  while (place.line < lines.size()) {
    const Words words = split(lines[place.line++]);
    if (words.size() > 1 && words[0] == "label" && words[1] == label) return;
  }
  throw Refusal{place.file + ": has no label " + label};
}

void Script::jump(const Words& words) {
  if (words.size() < 2) throw Refusal{"jump names no file"};
  // LAMMPS knows whether `next` has ended the loop: then it does not look for the label.
  command("jump SELF tandem_skip");
  if (!skips()) return;
  command("label tandem_skip");
  go_to(words[1], words.size() > 2 ? words[2] : "");
}

void Script::branch(const std::string& line) {
  command(line);
  if (!skips()) return;
  // A jump within it was taken; its label is one of those in the line.
  std::istringstream text(line);
  for (std::string word; text >> word;) {
    std::string file, label;
    if (word.find("jump") == std::string::npos || !(text >> file >> label)) continue;
    while (!label.empty() && (label.back() == '"' || label.back() == '\'')) label.pop_back();
    command("label " + label);
    if (!skips()) return go_to(file, label);
  }
  throw Refusal{"this jump cannot be followed: " + line};
}

void Script::begin_run(const Words& words, const std::string& line) {
  const auto steps = words.size() > 1 ? number(words[1]) : std::nullopt;
  if (!steps || *steps < 0) throw Refusal{"run has no number of steps: " + line};
  const std::int64_t now = step_now();
  const bool upto = holds(words, "upto");
  run_ = {.left = static_cast<std::int64_t>(*steps), .start = now, .stop = 0};
  if (upto) run_.left = std::max<std::int64_t>(run_.left - now, 0);
  run_.stop = now + run_.left;
  for (std::size_t i = 2; i + 1 < words.size(); ++i) {
    const auto value = number(words[i + 1]);
    if (words[i] == "start" && value) run_.start = static_cast<std::int64_t>(*value);
    if (words[i] == "stop" && value) run_.stop = static_cast<std::int64_t>(*value);
    if (words[i] == "every") {
      run_.left = 0;
      if (ranks_.first()) std::printf("not streamed, because of its 'every': %s\n", line.c_str());
      command(line);
      return;
    }
  }
  if (run_.left == 0) command("run 0 post no");
  // A lost atom is a body that vanished, which is no reason to end the session.
  if (!facts_.says_lost()) command("thermo_modify lost ignore flush no");
  ran_ = true;
  needs_setup_ = true;
}

bool Script::reach_run() {
  std::string line;
  while (run_.left == 0) {
    if (!next_line(line)) {
      if (!endless_ || !ran_) return false;
      run_.left = run_.stop = INT64_MAX / 4;
      return true;
    }
    execute(line);
  }
  return true;
}

std::int64_t Script::advance(std::int64_t steps) {
  std::int64_t made = 0;
  while (made < steps && reach_run()) {
    const std::int64_t now = std::min(steps - made, run_.left);
    std::string line = "run " + std::to_string(now) + (needs_setup_ ? " pre yes" : " pre no") + " post no";
    // Temperatures and the like go along the whole run. LAMMPS wants both within its own range of steps.
    if (run_.stop < INT64_MAX / 4)
      line += " start " + std::to_string(run_.start) + " stop " + std::to_string(run_.stop);
    command(line);
    needs_setup_ = false;
    run_.left -= now;
    made += now;
  }
  return made;
}

// Gravity

bool Script::take_gravity(const Words& words) {
  const bool is_2d = lammps_extract_setting(lammps_, "dimension") == 2;
  auto gravity = Facts::gravity_of(words, is_2d);
  if (gravity_ && words.size() > 1 && (words[0] == "fix" || words[0] == "unfix") && words[1] == gravity_->fix)
    gravity_.reset();
  if (!gravity || gravity_ || facts_.pours()) return false;
  turn_gravity(gravity->value);
  const std::string line = "fix " + gravity->fix + " " + gravity->group +
                           " gravity v_tandem_g vector v_tandem_gx v_tandem_gy v_tandem_gz";
  command(line);
  recorded_.push_back(line);
  gravity_ = std::move(gravity);
  return true;
}

void Script::give_gravity_back() {
  if (!gravity_) return;
  command(gravity_->line);
  recorded_.push_back(gravity_->line);
  gravity_.reset();
}

void Script::turn_gravity(const Vec3& value) {
  gravity_now_ = value;
  const double strength = std::hypot(value[0], value[1], value[2]);
  command("variable tandem_g equal " + exact(strength));
  for (std::size_t i = 0; i < 3; ++i) {
    const double along = strength > 0 ? value[i] / strength : i == 2 ? -1.0 : 0.0;
    command(std::string("variable tandem_g") + "xyz"[i] + " equal " + exact(along));
  }
}

// Files of a server

void Script::write_restart(const std::string& file) {
  command("write_restart " + file);
  // It moves atoms between ranks, but not their lists of neighbours.
  needs_setup_ = true;
}

std::string Script::save() const {
  std::ostringstream out;
  out << "run " << run_.left << ' ' << run_.start << ' ' << run_.stop << ' ' << ran_ << '\n';
  out << "gravity";
  for (const double value : gravity_now_) out << ' ' << exact(value);
  out << '\n';
  if (gravity_) out << "turns " << gravity_->fix << ' ' << gravity_->group << ' ' << gravity_->line << '\n';
  for (const Place& place : places_) out << "place " << place.line << ' ' << place.file << '\n';
  for (std::string line : recorded_) {
    std::replace(line.begin(), line.end(), '\n', ' ');
    out << "do " << line << '\n';
  }
  return out.str();
}

void Script::load(const std::string& saved, const std::string& restart_file) {
  command("clear");
  facts_.forget_all();
  gravity_.reset();
  recorded_.clear();
  places_.clear();
  std::vector<std::string> before, after;
  std::istringstream in(saved);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string key, rest;
    words >> key;
    if (key == "run") words >> run_.left >> run_.start >> run_.stop >> ran_;
    if (key == "gravity") {
      Vec3 value{};
      words >> value[0] >> value[1] >> value[2];
      turn_gravity(value);
    }
    if (key == "turns") {
      Gravity gravity{};
      words >> gravity.fix >> gravity.group >> std::ws;
      std::getline(words, gravity.line);
      gravity_ = std::move(gravity);
    }
    if (key == "place") {
      Place place;
      words >> place.line >> std::ws;
      std::getline(words, place.file);
      places_.push_back(std::move(place));
    }
    if (key == "do") {
      words >> std::ws;
      std::getline(words, rest);
      (holds(kBeforeAtoms, rest.substr(0, rest.find(' '))) ? before : after).push_back(rest);
    }
  }
  for (const std::string& line : before) command(line);
  command("read_restart " + restart_file);
  for (const std::string& line : after) {
    command(line);
    facts_.learn(split(line));
  }
  recorded_ = std::move(before);
  recorded_.insert(recorded_.end(), after.begin(), after.end());
  if (!facts_.says_lost()) command("thermo_modify lost ignore flush no");
  needs_setup_ = true;
}

}  // namespace tandem_lammps
