#pragma once
// The log of a program: one line each on stderr, for people, for journald or as JSON.

#include <cstdint>
#include <string>
#include <string_view>

namespace tandem {

enum class LogLevel : std::uint8_t;  // tandem/client_types.hpp

}  // namespace tandem

namespace tandem::logging {

struct LogOptions {
  /// Text: [time] [program] [session epoch] [level] message; to journald without time and program, which it
  /// knows, and with its priorities (sd-daemon(3)). JSON: one object a line with time (UTC), level, program,
  /// session, epoch, message.
  bool json = false;
  std::string level = "info";  ///< error, warning, info or debug; less urgent lines are left out
};

/// Lines of one program a second on average, and at once; of those above, one line every 10 s says how many
/// there were. Errors count, and are never left out.
inline constexpr double kLinesPerSecond = 10, kBurst = 300;

/// Makes the log that spdlog's functions write to. Lines go to stderr whole, from any thread. Call it before
/// other threads are started; a later call replaces the log.
void begin(const std::string& program, const LogOptions& options);

/// Writes a line of a client, or of what has a client's levels.
void write(LogLevel level, std::string_view line);

/// Writes an error, for callers without spdlog.
void error(const std::string& text);

/// Every later line names this session and epoch. `epoch` 0: not known yet.
void set_context(std::string_view session, std::uint64_t epoch);

}  // namespace tandem::logging
