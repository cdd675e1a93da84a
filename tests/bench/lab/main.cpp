// Measurements for which the tool has no command. Exit 0 done, 1 failed, 2 wrong usage.

#include <fmt/format.h>

#include <csignal>

#include "services/tool/print_error.hpp"
#include "tests/bench/lab/commands.hpp"

namespace {

std::atomic<bool> signalled = false;
static_assert(std::atomic<bool>::is_always_lock_free, "set from a signal handler");

}  // namespace

const std::atomic<bool>& tandem::lab::stop_on_signals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, [](int) { signalled = true; });
  return signalled;
}

int tandem::lab::refuse(const char* command, const Error& error) {
  tool::print_error(fmt::format("bench_lab {}: {}\n", command, error.message));
  return error.code == ErrorCode::kInvalidArgument ? 2 : 1;
}

int main(int argc, char** argv) {
  tandem::commandline::Program app{
      "Measures what developers of Tandem ask about, and trains the codecs of the thesis.", "bench_lab"};
  app.version("bench_lab " TANDEM_VERSION);
  app.require_subcommand();
  std::function<int()> run;
  tandem::lab::add_client_process(app, run);
  tandem::lab::add_door(app, run);
  tandem::lab::add_engine(app, run);
  tandem::lab::add_framerate(app, run);
  tandem::lab::add_memory(app, run);
  tandem::lab::add_scale(app, run);
  tandem::lab::add_smoothing(app, run);
  tandem::lab::add_train(app, run);
  if (const auto code = app.parse(argc, argv)) return *code;
  return run();
}
