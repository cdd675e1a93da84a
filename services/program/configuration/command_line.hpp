#pragma once
// The command line of a program that has a configuration: a flag for each field, and those that all programs
// have.

#include <google/protobuf/message.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/program/commandline/commandline.hpp"
#include "services/program/configuration/common.hpp"
#include "services/program/configuration/form.hpp"
#include "services/program/configuration/places.hpp"

namespace tandem::configuration {

/// What the program knows of its configuration. An empty function does nothing.
struct Rules {
  /// Drops from the file what conflicts with a flag.
  std::function<void(const google::protobuf::Message& flags, google::protobuf::Message& file)> displace = {};
  /// Adds the flags of fields that take something else than their values.
  std::map<std::string, std::function<void(commandline::Command, const Setting&)>> flags = {};
  /// Finds all that is wrong with file and flags, for --check-config. Without it, that is what reading them
  /// finds, and then `check`.
  std::function<std::vector<Error>(const std::string& path, const google::protobuf::Message& flags)>
      mistakes = {};
  /// Checks flags and file, merged.
  std::function<Result<void>(const google::protobuf::Message& config)> check = {};
};

/// What a program does after its command line: go on, or end with an exit code after what is printed.
struct Outcome {
  std::optional<int> exit_code = {};
  std::string why = {};   ///< of a usage error: its first line
  std::string path = {};  ///< of the file; empty: none
  Places places = {};
};

/// Reads flags, --config, --check-config, --print-config and --probe. `config` becomes the merged
/// configuration, which has passed check_values() and `check`; without defaults. `program` is its name.
[[nodiscard]] Outcome read_command_line(commandline::Program& app, const std::string& program,
                                        const Form& form, google::protobuf::Message& config,
                                        const Rules& rules, int argc, const char* const* argv);

/// The same for options that `options_of` makes of the merged configuration, and checks.
template <class Config, class Options>
[[nodiscard]] Parsed<Options> parse(commandline::Program& app, const std::string& program, const Form& form,
                                    Result<Options> (*options_of)(const Config&), int argc,
                                    const char* const* argv) {
  Config config;
  Options options;
  const Rules rules{.check = [&](const google::protobuf::Message& given) {
    return options_of(dynamic_cast<const Config&>(given)).map([&](Options&& read) {
      options = std::move(read);
    });
  }};
  const Outcome read = read_command_line(app, program, form, config, rules, argc, argv);
  if (read.exit_code) return {.options = std::nullopt, .exit_code = *read.exit_code};
  return {.options = std::move(options), .exit_code = 0};
}

/// Prints errors as wrong usage.
[[nodiscard]] Outcome refuse(const std::string& program, const std::vector<Error>& errors);

}  // namespace tandem::configuration
