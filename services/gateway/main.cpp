// tandem-gateway: serves a session to browsers. Exit 0 done, 1 failed, 2 wrong usage.

#include <spdlog/spdlog.h>

#include <exception>
#include <string_view>

#include "sdk/transport/dds/dds_ports.hpp"
#include "services/gateway/run.hpp"
#include "services/program/logging/log.hpp"
#include "services/program/process/heap.hpp"
#include "services/program/process/signal_watch.hpp"

int main(int argc, char** argv) {
  try {
    tandem::logging::begin("tandem-gateway", {});
    const auto command = tandem::gateway::parse_command_line(argc, argv);
    if (!command.options) return command.exit_code;
    tandem::logging::begin("tandem-gateway", command.options->log);
    tandem::logging::set_context(command.options->session, 0);
    tandem::transport::set_dds_log([](std::string_view line, bool error) {
      spdlog::log(error ? spdlog::level::err : spdlog::level::warn, "Cyclone DDS: {}", line);
    });
    // First, so that its signal mask holds for all threads.
    tandem::SignalWatch signals("tandem-gateway", tandem::SignalWatch::Hangup::kReload,
                                {&tandem::transport::dds_fault, &tandem::logging::error, true});
    const tandem::HeapTrimmer trimmer;
    return tandem::gateway::run(*command.options, signals);
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return 1;
  }
}
