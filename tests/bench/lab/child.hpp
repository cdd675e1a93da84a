#pragma once
// A child process, which never outlives this program.

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <string>
#include <vector>

#include "services/program/system/descriptor.hpp"
#include "tandem/result.hpp"

namespace tandem::lab {

/// How long a child may take to end.
inline constexpr std::chrono::seconds kChildEnd{20};

/// The path of the running program.
[[nodiscard]] std::string own_path();

struct ChildPlace {
  int name_space = -1;       ///< descriptor of a network namespace; -1: this one's
  std::string cgroup_procs;  ///< file to write the new process to; empty: none
  std::string dds_config;    ///< CYCLONEDDS_URI; empty: inherited
};

/// The destructor kills the process, and so does the death of this program. Not thread-safe.
class Child {
 public:
  /// Runs `arguments[0]`; its stdout is kept, its stderr thrown away. Errors: kIo.
  static Result<Child> start(const std::vector<std::string>& arguments, const ChildPlace& place);
  Child(Child&& other) noexcept;
  Child& operator=(Child&&) = delete;
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child();

  [[nodiscard]] pid_t pid() const { return pid_; }
  /// The processor time of all its threads, valid after finish().
  [[nodiscard]] double cpu_ms() const { return cpu_ms_; }
  /// Waits for its end and returns what it printed. Errors: kIo if it takes longer than that, exits with more
  /// than `most_status`, or `stop` is set meanwhile.
  Result<std::string> finish(std::chrono::seconds at_most, const std::atomic<bool>& stop,
                             int most_status = 0);

 private:
  Child(pid_t pid, system::Descriptor out) : pid_(pid), out_(std::move(out)) {}
  void kill_it();

  pid_t pid_;
  system::Descriptor out_;
  double cpu_ms_ = 0;
};

}  // namespace tandem::lab
