// tandem-gateway: serves a session to browsers. Exit 0 done, 1 failed, 2 wrong usage.

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <exception>

#include "services/gateway/command_line.hpp"
#include "services/gateway/run.hpp"
#include "services/process/heap.hpp"
#include "services/process/signal_watch.hpp"

int main(int argc, char** argv) {
  try {
    spdlog::set_default_logger(spdlog::stderr_color_mt("tandem-gateway"));
    const auto command = tandem::gateway::parse_command_line(argc, argv);
    if (!command.options) return command.exit_code;
    tandem::SignalWatch signals("tandem-gateway");  // first, so that its signal mask holds for all threads
    const tandem::HeapTrimmer trimmer;
    return tandem::gateway::run(*command.options, signals);
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return 1;
  }
}
