#pragma once
// What tandemd was asked to do: flags, on top of a configuration file, on top of defaults.

#include <cstdint>
#include <optional>
#include <string>

#include "tandem/result.hpp"

namespace tandem::daemon {

/// As given, by flags or by a file; nothing checked beyond its type.
struct Settings {
  std::optional<std::string> scene, session, codec, predictor, window, rate, stall_timeout, hash_log;
  std::optional<std::uint32_t> bodies, domain, budget_bytes, lead, client_limit, wait_for, threads, users;
  std::optional<std::uint64_t> seed;
  std::optional<double> threshold, threshold_scale, duration, target_bandwidth, max_error;
  std::optional<bool> scripted, automatic;
};

/// Checked and complete.
struct Options {
  std::string scene, session = "default", codec = "tracker", predictor = "auto", hash_log;
  std::uint32_t bodies = 0, domain = 0, lead = 1, client_limit = 256, wait_for = 0, threads = 1, users = 0;
  std::uint64_t seed = 1;
  std::optional<std::uint32_t> budget_bytes;
  std::optional<double> threshold_m;
  double threshold_scale = 1;
  bool automatic = false;  ///< --threshold auto
  double target_mbit_per_s = 0;
  std::optional<double> max_error_m;
  std::optional<double> duration_s;
  std::optional<std::uint32_t> window;          ///< empty: automatic
  std::optional<double> rate_hz;                ///< empty: the scene's
  bool free_rate = false;                       ///< --rate max
  std::optional<double> stall_timeout_s = 0.5;  ///< empty: off
  bool scripted = false;
  bool json = false;
};

/// Fields of `over` win over those of `under`.
[[nodiscard]] Settings overlay(const Settings& over, const Settings& under);

/// Reads a configuration file (idl/server.proto). Errors: kIo; kMalformed naming file, line and field.
[[nodiscard]] Result<Settings> load_config(const std::string& path);

/// Checks what needs no scene. Errors: kInvalidArgument naming the flag and what it takes.
[[nodiscard]] Result<Options> check_settings(const Settings& settings);

/// What the command line says: options to run with, or the exit code of --help, --version or a usage error,
/// whose text was printed.
struct CommandLine {
  std::optional<Options> options;
  int exit_code = 0;
};
[[nodiscard]] CommandLine parse_command_line(int argc, const char* const* argv);

}  // namespace tandem::daemon
