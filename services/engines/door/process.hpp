#pragma once
// An engine that the server starts and ends.

#include <sys/types.h>

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "services/program/system/descriptor.hpp"
#include "tandem/result.hpp"

namespace tandem::engine::door {

/// A command in a process group of its own, whose output is read. All of the group is killed at the end. Not
/// thread-safe.
class Process {
 public:
  static constexpr std::size_t kLastLines = 20;

  Process() = default;
  /// Starts `command` with sh(1). `environment`: variables to set. Errors: kIo.
  static Result<Process> start(const std::string& command,
                               const std::vector<std::pair<std::string, std::string>>& environment);
  Process(Process&& other) noexcept;
  Process& operator=(Process&& other) noexcept;
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() { end(0); }

  [[nodiscard]] bool started() const { return id_ > 0; }
  /// What it writes to stdout and stderr; -1: that ended.
  [[nodiscard]] int output() const { return output_.get(); }
  /// Takes what it wrote: whole lines, without control characters.
  [[nodiscard]] std::vector<std::string> read();
  /// The last lines that it wrote.
  [[nodiscard]] const std::deque<std::string>& last_lines() const { return last_; }
  /// How it ended, such as "exit code 1"; empty while it runs.
  [[nodiscard]] std::string ended();
  /// Waits at most `patience_ms` for its end, then kills its group. Returns what it still wrote.
  std::vector<std::string> end(int patience_ms);

 private:
  pid_t id_ = 0;
  system::Descriptor output_;
  std::string line_;  // not whole
  std::deque<std::string> last_;
};

/// A word of a command for sh(1), whatever it holds.
[[nodiscard]] std::string quoted(const std::string& word);

/// True if a process of this machine is stopped, by a signal or a debugger.
[[nodiscard]] bool is_stopped(pid_t process);
/// True if there is no such process any more, or it has ended and nobody has asked how.
[[nodiscard]] bool is_gone(pid_t process);

}  // namespace tandem::engine::door
