#include "services/tool/log_options.hpp"

#include <spdlog/spdlog.h>

#include "sdk/transport/dds/dds_ports.hpp"

namespace tandem::tool {

void begin_log(const std::string& program, const logging::LogOptions& options, const std::string& session) {
  logging::begin(program, options);
  logging::set_context(session, 0);
  transport::set_dds_log([](std::string_view line, bool error) {
    spdlog::log(error ? spdlog::level::err : spdlog::level::warn, "Cyclone DDS: {}", line);
  });
}

}  // namespace tandem::tool
