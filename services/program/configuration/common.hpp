#pragma once
// The options that programs share, also of commands that have no configuration. Sees no protobuf.

#include <optional>

#include "services/program/commandline/commandline.hpp"
#include "services/program/logging/log.hpp"
#include "services/program/metrics/address.hpp"

namespace google::protobuf {
class Message;
}

namespace tandem::configuration {

/// A program's options; empty: it ends with `exit_code` after what is printed.
template <class Options>
struct Parsed {
  std::optional<Options> options;
  int exit_code = 0;
};

/// Adds --log-format and --log-level. `options` outlives `command`.
void add_log_flags(commandline::Command command, logging::LogOptions& options);
/// Adds --metrics. `address` outlives `command`.
void add_metrics_flag(commandline::Command command, std::optional<metrics::Address>& address);

/// What log_format and log_level of a configuration say that is complete and checked.
[[nodiscard]] logging::LogOptions log_of(const google::protobuf::Message& config);
/// What its metrics say; empty: none are served. Errors: kInvalidArgument, which begins with the flag.
[[nodiscard]] Result<std::optional<metrics::Address>> metrics_of(const google::protobuf::Message& config);

}  // namespace tandem::configuration
