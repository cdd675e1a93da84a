// tandemd: simulates a scene and streams it. Exit 0 done, 1 failed, 2 wrong usage.

#include <spdlog/spdlog.h>

#include <exception>
#include <string_view>

#include "sdk/transport/dds/dds_ports.hpp"
#include "services/engines/door/door.hpp"
#include "services/program/logging/log.hpp"
#include "services/program/process/heap.hpp"
#include "services/program/process/init.hpp"
#include "services/program/process/signal_watch.hpp"
#include "services/tandemd/configuration/command_line.hpp"
#include "services/tandemd/daemon.hpp"

int main(int argc, char** argv) {
  tandem::leave_process_1();
  try {
    tandem::logging::begin("tandemd", {});
    auto command = tandem::daemon::parse_command_line(argc, argv);
    if (!command.options) {
      const int engine = tandem::daemon::inherited_engine(argc, argv);
      if (engine >= 0 && !command.why.empty()) tandem::engine::door::turn_away(engine, command.why);
      return command.exit_code;
    }
    tandem::logging::begin("tandemd", command.options->log);
    tandem::logging::set_context(command.options->session, 0);
    tandem::transport::set_dds_log([](std::string_view line, bool error) {
      spdlog::log(error ? spdlog::level::err : spdlog::level::warn, "Cyclone DDS: {}", line);
    });
    // First, so that its signal mask holds for all threads.
    using Hangup = tandem::SignalWatch::Hangup;
    tandem::SignalWatch signals("tandemd", command.reread ? Hangup::kReload : Hangup::kStop,
                                {&tandem::transport::dds_fault, &tandem::logging::error, true});
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
