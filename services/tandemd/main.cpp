// tandemd: simulates a scene and streams it. Exit 0 done, 1 failed, 2 wrong usage.

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <exception>

#include "services/process/heap.hpp"
#include "services/process/signal_watch.hpp"
#include "services/tandemd/configuration/command_line.hpp"
#include "services/tandemd/daemon.hpp"

int main(int argc, char** argv) {
  try {
    spdlog::set_default_logger(spdlog::stderr_color_mt("tandemd"));
    auto command = tandem::daemon::parse_command_line(argc, argv);
    if (!command.options) return command.exit_code;
    // First, so that its signal mask holds for all threads.
    using Hangup = tandem::SignalWatch::Hangup;
    tandem::SignalWatch signals("tandemd", command.reread ? Hangup::kReload : Hangup::kStop);
    if (command.reread) {
      command.options->changes = [&]() -> std::optional<tandem::Result<tandem::daemon::Changes>> {
        if (!signals.take_reload()) return std::nullopt;
        return command.reread();
      };
    }
    const tandem::HeapTrimmer trimmer;
    return tandem::daemon::run_daemon(*command.options, signals);
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return 1;
  }
}
