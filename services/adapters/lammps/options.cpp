// SPDX-License-Identifier: MIT
#include "services/adapters/lammps/options.hpp"

#include <cstdio>
#include <cstdlib>
#include <functional>

#include "services/adapters/lammps/facts.hpp"

namespace tandem_lammps {
namespace {

constexpr const char* kAbout =
    "Runs a LAMMPS script on any number of MPI ranks, as an engine that tandemd streams.";
constexpr const char* kNotes =
    "Start it by tandemd --engine 'mpirun -n 4 tandem-lammps in.script', or by mpirun beside tandemd --engine-socket PATH. What "
    "stands behind -- goes to LAMMPS. Exits with 0 when the server or the script ends, 1 if the server or the script is "
    "refused, 2 for a wrong command line; LAMMPS's own errors are exit code 1.";

/// An option: how it is named, what it takes (none: a flag), and what it sets. False: the value is wrong.
struct Option {
  const char* name;
  const char* takes;
  const char* about;
  std::function<bool(LammpsOptions&, const std::string&)> set;
};

bool positive(const std::string& word, double& value, double most) {
  const auto read = number(word);
  if (!read || !(*read > 0) || *read > most) return false;
  value = *read;
  return true;
}

template <class T>
bool whole(const std::string& word, T& value, double most) {
  double read = 0;
  if (!positive(word, read, most) || read < 1 || read > static_cast<double>(static_cast<T>(read)))
    return false;
  value = static_cast<T>(read);
  return true;
}

bool limit(const std::string& word, std::optional<double>& value) {
  value = number(word);
  return value && *value >= 0;
}

const std::vector<Option>& all() {
  static const std::vector<Option> options{
      {"--socket", "PATH", "The server's --engine-socket, instead of TANDEM_DOOR",
       [](LammpsOptions& o, const std::string& w) { return !(o.socket = w).empty(); }},
      {"--every", "STEPS",
       "LAMMPS steps of a frame; chosen so that 30 frames are a second of the script's time if its units know one and 100 "
       "steps are enough for that, else 10",
       [](LammpsOptions& o, const std::string& w) { return whole(w, o.every, 1e9); }},
      {"--rate", "HZ", "Frames of a second of the viewers; by the script's time, or 30",
       [](LammpsOptions& o, const std::string& w) { return positive(w, o.rate_hz, 1000) && o.rate_hz >= 1; }},
      {"--capacity", "ATOMS",
       "The most atoms at a time, 1 to 4194304; those of the script at its first run, and as many again if it pours",
       [](LammpsOptions& o, const std::string& w) { return whole(w, o.capacity, 4194304); }},
      {"--radius", "LENGTH",
       "Of atoms without a radius of their own; half of sigma, or by the number of atoms in the box",
       [](LammpsOptions& o, const std::string& w) { return positive(w, o.radius, 1e30); }},
      {"--gravity", "MOST",
       "The largest gravity that users may send, 0: none; four times the script's, if that is a constant one",
       [](LammpsOptions& o, const std::string& w) { return limit(w, o.gravity); }},
      {"--push", "MOST", "The largest push that users may send, 0: none; by radius and timestep",
       [](LammpsOptions& o, const std::string& w) { return limit(w, o.push); }},
      {"--threshold", "LENGTH", "The largest error that clients see; a fiftieth of the smallest radius",
       [](LammpsOptions& o, const std::string& w) { return positive(w, o.threshold, 1e30); }},
      {"--session", "NAME", "A wish for the session's name",
       [](LammpsOptions& o, const std::string& w) { return !(o.session = w).empty(); }},
      {"--var", "NAME=VALUE", "A variable of the script",
       [](LammpsOptions& o, const std::string& w) {
         const std::size_t at = w.find('=');
         if (at == std::string::npos || at == 0) return false;
         o.for_lammps.insert(o.for_lammps.end(), {"-var", w.substr(0, at), w.substr(at + 1)});
         return true;
       }},
      {"--endless", nullptr, "Go on with the last run when the script is over, instead of holding still",
       [](LammpsOptions& o, const std::string&) { return o.endless = true; }}};
  return options;
}

void help() {
  std::printf("%s\n\nUsage: tandem-lammps [OPTIONS] SCRIPT [-- ARGUMENTS OF LAMMPS]\n\n", kAbout);
  for (const Option& option : all())
    std::printf("  %s %s\n      %s\n", option.name, option.takes ? option.takes : "", option.about);
  std::printf("  -h,--help  \n  --version  \n\n%s\n", kNotes);
}

}  // namespace

std::optional<int> parse(int argc, const char* const* argv, bool prints, LammpsOptions& options) {
  const auto wrong = [prints](const std::string& what) {
    if (prints)
      std::fprintf(stderr, "tandem-lammps: %s\nRun with --help for more information.\n", what.c_str());
    return 2;
  };
  for (int i = 1; i < argc; ++i) {
    std::string word = argv[i];
    if (word == "--help" || word == "-h") {
      if (prints) help();
      return 0;
    }
    if (word == "--version") {
      if (prints) std::printf("tandem-lammps %s\n", TANDEM_VERSION);
      return 0;
    }
    if (word == "--") {
      options.for_lammps.insert(options.for_lammps.end(), argv + i + 1, argv + argc);
      break;
    }
    if (!word.starts_with("--")) {
      if (!options.script.empty()) return wrong("one script only: what does " + word + " mean?");
      options.script = word;
      continue;
    }
    std::optional<std::string> value;
    if (const std::size_t at = word.find('='); at != std::string::npos) {
      value = word.substr(at + 1);
      word.resize(at);
    }
    const Option* found = nullptr;
    for (const Option& option : all())
      if (word == option.name) found = &option;
    if (found == nullptr) return wrong(word + " is not known");
    if (found->takes != nullptr && !value) {
      if (i + 1 == argc) return wrong(word + " needs " + found->takes);
      value = argv[++i];
    }
    if (found->takes == nullptr && value) return wrong(word + " takes no value");
    if (!found->set(options, value.value_or("")))
      return wrong(word + ": not a good " + (found->takes ? found->takes : "flag") + ": " + *value);
  }
  if (options.script.empty()) return wrong("which script?");
  return std::nullopt;
}

}  // namespace tandem_lammps
