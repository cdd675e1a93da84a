#pragma once
// The system's counters of a running process and its threads.

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "services/program/system/descriptor.hpp"
#include "tandem/result.hpp"

namespace tandem::lab {

struct ThreadReading {
  std::string name;
  std::int64_t cpu_ns = 0;
  std::uint64_t wakeups = 0;  ///< number of times it gave up its core by itself
};

/// A process at one moment.
struct ProcessReading {
  std::int64_t steady_ns = 0;
  std::map<pid_t, ThreadReading> threads;
  double resident_mb = 0;  ///< 2^20 bytes
};

/// Errors: kIo if there is no such process.
[[nodiscard]] Result<ProcessReading> read_process(pid_t process);

/// The difference between two readings, in threads that both have seen.
struct ProcessSpan {
  double seconds = 0;
  double cpu_ms = 0;
  std::map<std::string, double> cpu_ms_by_thread;  ///< threads with the same name are added up
  double wakeups = 0;
};
[[nodiscard]] ProcessSpan between(const ProcessReading& before, const ProcessReading& after);

/// Counts the system calls of all threads that a process has at the moment, by the kernel's tracepoint.
class SyscallCounter {
 public:
  /// Empty if the kernel has no such tracepoint or does not let this user read it.
  static std::optional<SyscallCounter> start(const ProcessReading& process);
  [[nodiscard]] std::uint64_t calls() const;

 private:
  std::vector<system::Descriptor> counters_;
};

}  // namespace tandem::lab
