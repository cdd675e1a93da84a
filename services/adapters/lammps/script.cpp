// SPDX-License-Identifier: MIT
#include "services/adapters/lammps/script.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include "services/adapters/lammps/lammps.hpp"

namespace tandem_lammps {
namespace {

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
  if (!first_.empty()) {
    line = std::move(first_.front());
    first_.pop_front();
    return true;
  }
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

bool Script::loop_has_ended() {
  command("jump SELF tandem_skip");  // LAMMPS leaves it out after a `next` that ended a loop
  if (!skips()) return true;
  command("label tandem_skip");
  return false;
}

const char* Script::value_of(const std::string& variable) const {
  return static_cast<const char*>(lammps_extract_variable(lammps_, variable.c_str(), nullptr));
}

Words Script::words_of(const std::string& line) {
  // They are the values of a variable of LAMMPS, behind the first one.
  command("variable tandem_words index . " + line);
  Words words;
  for (;;) {
    command("next tandem_words");
    const char* const word = value_of("tandem_words");
    if (word == nullptr) break;
    words.emplace_back(word);
  }
  loop_has_ended();  // takes back what the last `next` said
  return words;
}

void Script::execute(const std::string& line) {
  const Words words = words_of(line);
  if (words.empty()) return;
  const std::string& name = words[0];
  if (name == "label") return;
  if (name == "include" && words.size() > 1) return open(words[1]);
  if (name == "jump") return jump(words);
  if (name == "if") return branch(words);
  if (name == "run") return begin_run(words);
  if (name == "quit") {
    first_.clear();
    places_.resize(1);
    places_[0].line = lines_of(places_[0].file).size();
    return;
  }
  if (name == "fix" && words.size() > 3 && words[3] == "imd" &&
      !(holds(words, "nowait") && holds(words, "on")))
    throw Refusal{"fix imd waits for a viewer of its own: say `nowait on` there, or leave it out"};
  // `fix pour` checks the gravity while it is made.
  if (name == "fix" && words.size() > 3 && words[3] == "pour") give_gravity_back();
  if (!take_gravity(words)) {
    // A variable that is replaced once may be random: LAMMPS gets what was read here.
    const Words now = name == "thermo_style" ? without_the_uncertain(words) : words;
    if (name == "thermo_modify" && fewer_columns_ && (holds(words, "format") || holds(words, "line"))) return;
    command(now == words && line.find('$') == std::string::npos ? line : joined(now));
    recorded_.add(now);
  }
  if (name == "next" && loop_has_ended()) {
    skip_jump_ = true;
    for (std::size_t i = 1; i < words.size(); ++i) recorded_.add({"variable", words[i], "delete"});
  }
  if (name == "clear") gravity_.reset();
  facts_.learn(words);
  needs_setup_ = true;
}

// LAMMPS computes all columns at the end of each frame, when a fix may have no value, and then ends.
Words Script::without_the_uncertain(const Words& thermo_style) {
  const auto uncertain = [](const std::string& word) {
    return word.starts_with("f_") || word.starts_with("v_");
  };
  fewer_columns_ = std::any_of(thermo_style.begin(), thermo_style.end(), uncertain);
  if (!fewer_columns_) return thermo_style;
  Words fewer;
  std::remove_copy_if(thermo_style.begin(), thermo_style.end(), std::back_inserter(fewer), uncertain);
  // The script may ask for what its variables had LAMMPS compute.
  for (const char* const column : {"step", "temp", "pe", "press"})
    if (!holds(fewer, column)) fewer.emplace_back(column);
  return fewer;
}

void Script::jump(const Words& words) {
  if (words.size() < 2) throw Refusal{"jump names no file"};
  if (std::exchange(skip_jump_, false)) return;
  first_.clear();
  Place& place = places_.back();
  if (words[1] != "SELF") place.file = words[1];
  place.line = 0;
  const std::vector<std::string>& lines = lines_of(place.file);
  if (words.size() < 3) return;
  command("jump SELF " + joined({words[2]}));  // LAMMPS skips what it gets, until that label
  while (place.line < lines.size())
    if (command(lines[place.line++]) != nullptr && !skips()) return;
  throw Refusal{place.file + ": has no label " + words[2]};
}

void Script::branch(const Words& words) {
  // LAMMPS tells which part of it holds; the part is executed here, for it may have a run.
  std::vector<Words> parts;
  Words question;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool begins =
        words[i] == "then" || words[i] == "else" || (words[i] == "elif" && i + 2 < words.size());
    if (!begins && !parts.empty()) {
      parts.back().push_back(words[i]);
      continue;
    }
    question.push_back(words[i]);
    if (!begins) continue;
    if (words[i] == "elif") question.push_back(words[++i]);
    question.push_back("variable tandem_if index " + std::to_string(parts.size()));
    parts.emplace_back();
  }
  command(joined(question));
  const auto part = number(value_of("tandem_if") == nullptr ? "" : value_of("tandem_if"));
  if (!part) return;
  command("variable tandem_if delete");
  const Words& lines = parts.at(static_cast<std::size_t>(*part));
  first_.insert(first_.begin(), lines.begin(), lines.end());
}

void Script::begin_run(const Words& words) {
  const auto steps = words.size() > 1 ? number(words[1]) : std::nullopt;
  if (!steps || *steps < 0) throw Refusal{"run has no number of steps: " + joined(words)};
  const std::int64_t now = step_now();
  run_ = {.left = static_cast<std::int64_t>(*steps), .start = now, .stop = 0};
  if (holds(words, "upto")) run_.left = std::max<std::int64_t>(run_.left - now, 0);
  run_.stop = now + run_.left;
  needs_setup_ = true;
  for (std::size_t i = 2; i + 1 < words.size(); ++i) {
    const auto value = number(words[i + 1]);
    if (words[i] == "start" && value) run_.start = static_cast<std::int64_t>(*value);
    if (words[i] == "stop" && value) run_.stop = static_cast<std::int64_t>(*value);
    if (words[i] == "pre") needs_setup_ = words[i + 1] != "no";
    if (words[i] != "every") continue;
    // That many steps, the commands, and the rest in the same way.
    if (!value || *value < 1) throw Refusal{"run has no number of steps behind every: " + joined(words)};
    const std::int64_t rest = run_.left - static_cast<std::int64_t>(*value);
    run_.left = std::min(run_.left, static_cast<std::int64_t>(*value));
    Words again{"run",  std::to_string(rest),     "start", std::to_string(run_.start),
                "stop", std::to_string(run_.stop)};
    again.insert(again.end(), words.begin() + static_cast<std::ptrdiff_t>(i), words.end());
    if (rest > 0) first_.push_front(joined(again));
    for (std::size_t k = words.size(); k-- > i + 2;)
      if (words[k] != "NULL") first_.push_front(words[k]);
    break;
  }
  if (run_.left == 0) command("run 0 post no");
  // A lost atom is a body that vanished, which is no reason to end the session.
  if (!facts_.says_lost()) command("thermo_modify lost ignore flush no");
  ran_ = true;
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
    std::string line = "run " + std::to_string(now) +
                       (needs_setup_ || facts_.always_sets_up() ? " pre yes" : " pre no") + " post no";
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
  const Words turned{"fix",    gravity->fix,  gravity->group, "gravity",    "v_tandem_g",
                     "vector", "v_tandem_gx", "v_tandem_gy",  "v_tandem_gz"};
  command(joined(turned));
  recorded_.add(turned);
  gravity_ = std::move(gravity);
  return true;
}

void Script::give_gravity_back() {
  if (!gravity_) return;
  command(joined(gravity_->words));
  recorded_.add(gravity_->words);
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
  command("write_restart " + joined({file}));
  refresh();
}

// Atoms moved between ranks without their lists of neighbours, and what the last step computed is gone; the
// next line of the script may ask for it.
void Script::refresh() {
  if (run_.left == 0) command("run 0 post no");
  needs_setup_ = true;
}

std::string Script::save() const {
  std::ostringstream out;
  out << "run " << run_.left << ' ' << run_.start << ' ' << run_.stop << ' ' << ran_ << ' ' << skip_jump_
      << ' ' << fewer_columns_ << '\n';
  out << "gravity";
  for (const double value : gravity_now_) out << ' ' << exact(value);
  out << '\n';
  // A text may be of several lines.
  const auto put = [&out](const char* key, const std::string& text) {
    out << key << ' ' << text.size() << ' ' << text << '\n';
  };
  if (gravity_) put("turns", joined(gravity_->words));
  for (const Place& place : places_) put(("place " + std::to_string(place.line)).c_str(), place.file);
  for (const std::string& line : first_) put("first", line);
  for (const Words& words : recorded_.lines()) {
    put("do", joined(words));
    const char* const value = Recorded::is_loop(words) ? value_of(words[1]) : nullptr;
    if (value != nullptr) put("at", value);
  }
  return out.str();
}

void Script::set_loop(const Words& words, const std::string& value) {
  command("variable " + words[1] + " delete");
  command(joined(words));
  while (value_of(words[1]) != nullptr && value != value_of(words[1])) command("next " + words[1]);
  if (value_of(words[1]) != nullptr) return;
  loop_has_ended();
  command(joined({"variable", words[1], "index", value}));  // it came from the command line
}

void Script::load(const std::string& saved, const std::string& restart_file) {
  for (const Words& words : recorded_.lines())  // they may hold what `clear` destroys
    if (Recorded::is_loop(words)) command("variable " + words[1] + " delete");
  command("clear");
  facts_.forget_all();
  gravity_.reset();
  recorded_.clear();
  places_.clear();
  first_.clear();
  Words turns;
  std::vector<std::pair<Words, std::string>> lines;  // and the value of a loop's variable
  std::istringstream in(saved);
  const auto take = [&in, &saved] {
    std::size_t size = 0;
    in >> size;
    in.get();
    std::string text(std::min(size, saved.size()), '\0');
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    return text;
  };
  for (std::string key; in >> key;) {
    if (key == "run") in >> run_.left >> run_.start >> run_.stop >> ran_ >> skip_jump_ >> fewer_columns_;
    if (key == "gravity") {
      Vec3 value{};
      in >> value[0] >> value[1] >> value[2];
      turn_gravity(value);
    }
    if (key == "turns") turns = words_of(take());
    if (key == "place") {
      Place place;
      in >> place.line;
      place.file = take();
      places_.push_back(std::move(place));
    }
    if (key == "first") first_.push_back(take());
    if (key == "do") lines.emplace_back(words_of(take()), std::string());
    if (key == "at" && !lines.empty()) lines.back().second = take();
  }
  if (places_.empty()) throw Refusal{"a saved world cannot be read"};
  for (const auto& [words, value] : lines) {
    recorded_.add(words);
    facts_.learn(words);
  }
  const auto again = [&](bool before_atoms) {
    for (const auto& [words, value] : lines) {
      if (Recorded::comes_before_atoms(words) != before_atoms || recorded_.comes_with_atoms(words)) continue;
      if (Recorded::is_loop(words) && !value.empty()) {
        set_loop(words, value);
      } else {
        command(joined(words));
      }
    }
  };
  again(true);
  command("read_restart " + joined({restart_file}));
  gravity_ = Facts::gravity_of(turns, lammps_extract_setting(lammps_, "dimension") == 2);
  again(false);
  if (!facts_.says_lost()) command("thermo_modify lost ignore flush no");
  refresh();
}

}  // namespace tandem_lammps
