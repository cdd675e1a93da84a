// The world in one process, under random faults from a seed.

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <unistd.h>

#include "sdk/core/lattice/assert.hpp"
#include "tests/fault/world/shrink.hpp"
#include "tests/fault/world/world.hpp"

namespace tandem::world {
namespace {

constexpr const char* kHelp =
    R"(Lives of a whole world of Tandem in one process, under random faults from a seed.

  tandem_world [--seed N | --seeds N [--from N]] [options]

  --seed N           one world, with its digest: the same on every run
  --seeds N          so many worlds (default 300), up to the first finding
  --from N           the first of them (default 1)
  --seconds S        of simulated time in each world, 25 to 3600 (default 60)
  --faults A,B|all|none   kinds of faults (default all); an unknown one lists them
  --without 3,7      leaves out these faults of the plan
  --only 3,7         leaves out all others
  --shrink           removes the faults that a finding does not need
  --record FILE.mcap records the world as an observer sees it, with the timeline as messages of /events
  --timeline         prints what happened even if nothing was found
  --keep-going       does not stop at a finding
  --budget S         stops after so many seconds of processor time
  --help, --version

Exit: 0 nothing found, 1 something found, 2 usage.
)";

struct Options {
  RunOptions run;
  std::uint64_t from = 1, seeds = 300;
  std::string faults = "all";
  std::set<std::uint32_t> without, only;
  bool one = false, shrinks = false, timeline = false, keeps_going = false;
  double budget_s = 0;
};

volatile std::uint64_t running_seed = 0;
std::string running_command;

// The process ends behind it, through on_crash().
void on_broken_invariant(const char* condition, const char* file, int line) {
  std::printf("\nseed %llu: broken invariant: %s, %s:%d, at %.3f s\n  %s\n",
              static_cast<unsigned long long>(running_seed), condition, file, line,
              static_cast<double>(living_ns()) / 1e9, running_command.c_str());
  std::fflush(stdout);
}

// A crash of the product is a finding, too.
void on_crash(int signal) {
  char text[96];
  const int length = std::snprintf(text, sizeof text, "\nseed %llu: crash: signal %d\n",
                                   static_cast<unsigned long long>(running_seed), signal);
  if (write(STDOUT_FILENO, text, static_cast<std::size_t>(length)) < 0) _exit(4);
  _exit(3);
}

std::set<std::uint32_t> numbers(const char* text) {
  std::set<std::uint32_t> all;
  for (char* end = nullptr; *text != '\0'; text = *end == ',' ? end + 1 : end) {
    all.insert(static_cast<std::uint32_t>(std::strtoul(text, &end, 10)));
    if (end == text) break;
  }
  return all;
}

bool read(int count, char** words, Options& options) {
  for (int i = 1; i < count; ++i) {
    const std::string_view word = words[i];
    if (word == "--shrink") {
      options.shrinks = true;
    } else if (word == "--timeline") {
      options.timeline = true;
    } else if (word == "--keep-going") {
      options.keeps_going = true;
    } else if (i + 1 == count) {
      return false;
    } else if (word == "--seed") {
      options.from = std::strtoull(words[++i], nullptr, 10);
      options.seeds = 1;
      options.one = true;
    } else if (word == "--seeds") {
      options.seeds = std::strtoull(words[++i], nullptr, 10);
    } else if (word == "--from") {
      options.from = std::strtoull(words[++i], nullptr, 10);
    } else if (word == "--seconds") {
      options.run.seconds = std::strtod(words[++i], nullptr);
    } else if (word == "--faults") {
      options.faults = words[++i];
    } else if (word == "--without") {
      options.without = numbers(words[++i]);
    } else if (word == "--only") {
      options.only = numbers(words[++i]);
    } else if (word == "--record") {
      options.run.record = words[++i];
    } else if (word == "--budget") {
      options.budget_s = std::strtod(words[++i], nullptr);
    } else {
      return false;
    }
  }
  return options.run.seconds >= 25 && options.run.seconds <= 3600 && options.from > 0;
}

std::string command(const Options& options, std::uint64_t seed, const Plan& whole, const Plan& plan) {
  char seconds[32];
  std::snprintf(seconds, sizeof seconds, "%g", options.run.seconds);
  std::string line = "tandem_world --seed " + std::to_string(seed) + " --seconds " + seconds;
  if (options.faults != "all") line += " --faults " + options.faults;
  if (plan.size() == whole.size()) return line;
  std::string ids;
  for (const Fault& fault : plan) ids += (ids.empty() ? "" : ",") + std::to_string(fault.id);
  return plan.empty() ? line + " --faults none" : line + " --only " + ids;
}

int run(const Options& options) {
  const auto kinds = read_kinds(options.faults);
  if (!kinds) {
    std::fprintf(stderr, "tandem_world: %s\n", kinds.error().message.c_str());
    return 2;
  }
  std::uint64_t found = 0, done = 0;
  Counts sums;
  const std::clock_t began = std::clock();
  const auto spent_s = [&] { return static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC; };
  for (std::uint64_t seed = options.from; seed < options.from + options.seeds; ++seed) {
    if (options.budget_s > 0 && spent_s() > options.budget_s) break;
    RunOptions run = options.run;
    run.seed = seed;
    running_seed = seed;
    const Plan whole = plan_of(run, *kinds);
    Plan plan = whole;
    std::erase_if(plan, [&](const Fault& fault) {
      return options.without.contains(fault.id) ||
             (!options.only.empty() && !options.only.contains(fault.id));
    });
    running_command = command(options, seed, whole, plan);
    Outcome outcome = run_world(run, plan);
    ++done;
    sums.frames += outcome.counts.frames;
    sums.acts += outcome.counts.acts;
    sums.epochs += outcome.counts.epochs;
    sums.network.delivered += outcome.counts.network.delivered;
    sums.network.repaired += outcome.counts.network.repaired;
    sums.network.damaged += outcome.counts.network.damaged;
    sums.turns += outcome.counts.turns;
    if (outcome.finding && options.shrinks) {
      plan = shrink(plan, outcome.finding->invariant, [&](const Plan& smaller) {
        RunOptions unrecorded = run;
        unrecorded.record.clear();
        return run_world(unrecorded, smaller);
      });
      outcome = run_world(run, plan);
    }
    if (options.timeline || (outcome.finding && !options.keeps_going))
      std::printf("%s", outcome.journal.text().c_str());
    if (outcome.finding) {
      ++found;
      std::printf("seed %llu: %s: %s, at %.3f s: %s\n  %s\n", static_cast<unsigned long long>(seed),
                  outcome.finding->invariant.c_str(), outcome.finding->who.c_str(),
                  static_cast<double>(outcome.finding->at_ns) / 1e9, outcome.finding->what.c_str(),
                  command(options, seed, whole, plan).c_str());
      std::fflush(stdout);
      if (!options.keeps_going) break;
    }
    if (options.one) std::printf("digest %016llx\n", static_cast<unsigned long long>(outcome.digest));
  }
  std::printf(
      "%llu worlds of %g s from seed %llu: %llu findings; %llu frames, %llu epochs, %llu inputs acted, %llu samples, %llu "
      "repaired, %llu damaged; %.3f s of processor a world\n",
      static_cast<unsigned long long>(done), options.run.seconds,
      static_cast<unsigned long long>(options.from), static_cast<unsigned long long>(found),
      static_cast<unsigned long long>(sums.frames), static_cast<unsigned long long>(sums.epochs),
      static_cast<unsigned long long>(sums.acts), static_cast<unsigned long long>(sums.network.delivered),
      static_cast<unsigned long long>(sums.network.repaired),
      static_cast<unsigned long long>(sums.network.damaged),
      spent_s() / static_cast<double>(done == 0 ? 1 : done));
  return found == 0 ? 0 : 1;
}

}  // namespace
}  // namespace tandem::world

int main(int count, char** words) {
  using namespace tandem::world;
  for (int i = 1; i < count; ++i) {
    if (std::strcmp(words[i], "--help") == 0) return std::printf("%s", kHelp) < 0 ? 1 : 0;
    if (std::strcmp(words[i], "--version") == 0)
      return std::printf("tandem_world %s\n", TANDEM_VERSION) < 0 ? 1 : 0;
  }
  Options options;
  if (!read(count, words, options)) {
    std::fprintf(stderr, "%s", kHelp);
    return 2;
  }
  tandem::assertion_handler = on_broken_invariant;
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL}) std::signal(signal, on_crash);
  return run(options);
}
