#include "services/tool/log_options.hpp"

#include <spdlog/spdlog.h>

#include "sdk/transport/dds/dds_ports.hpp"

namespace tandem::tool {

void add_log_options(commandline::Command command, logging::Options& options) {
  command.add_choice("--log-format", options.format,
                     {{"text", logging::Format::kText}, {"json", logging::Format::kJson}},
                     "How lines of the log look: for people and journald, or one JSON object each [text]");
  command.add_choice("--log-level", options.level,
                     {{"error", logging::Level::kError},
                      {"warning", logging::Level::kWarning},
                      {"info", logging::Level::kInfo},
                      {"debug", logging::Level::kDebug}},
                     "The least urgent lines that are logged [info]");
}

void begin_log(const std::string& program, const logging::Options& options, const std::string& session) {
  logging::begin(program, options);
  logging::set_context(session, 0);
  transport::set_dds_log([](std::string_view line, bool error) {
    spdlog::log(error ? spdlog::level::err : spdlog::level::warn, "Cyclone DDS: {}", line);
  });
}

}  // namespace tandem::tool
