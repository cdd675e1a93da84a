#include "tests/bench/lab/process_counters.hpp"

#include <fmt/format.h>
#include <linux/perf_event.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "services/lab/measures/replay.hpp"

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;

/// The number behind `key` in a file with lines `key: number`; 0 if there is none.
std::uint64_t number_of(const fs::path& file, std::string_view key) {
  std::ifstream in(file);
  for (std::string word; in >> word;) {
    std::uint64_t number = 0;
    if (word == key && in >> number) return number;
  }
  return 0;
}

std::optional<std::uint64_t> tracepoint() {
  for (const char* root : {"/sys/kernel/tracing", "/sys/kernel/debug/tracing"}) {
    std::ifstream in(fs::path(root) / "events/raw_syscalls/sys_enter/id");
    if (std::uint64_t id = 0; in >> id) return id;
  }
  return std::nullopt;
}

}  // namespace

Result<ProcessReading> read_process(pid_t process) {
  const fs::path folder = fmt::format("/proc/{}", process);
  ProcessReading reading{.steady_ns = steady_ns(), .threads = {}};
  std::error_code gone;
  for (const auto& entry : fs::directory_iterator(folder / "task", gone)) {
    ThreadReading thread;
    std::ifstream name(entry.path() / "comm");
    std::ifstream times(entry.path() / "schedstat");
    if (!std::getline(name, thread.name) || !(times >> thread.cpu_ns)) continue;  // it ended meanwhile
    thread.wakeups = number_of(entry.path() / "status", "voluntary_ctxt_switches:");
    reading.threads.emplace(static_cast<pid_t>(std::stol(entry.path().filename())), std::move(thread));
  }
  if (reading.threads.empty()) return fail(ErrorCode::kIo, fmt::format("no process {}", process));
  reading.resident_mb = static_cast<double>(number_of(folder / "status", "VmRSS:")) / 1024;
  return reading;
}

ProcessSpan between(const ProcessReading& before, const ProcessReading& after) {
  ProcessSpan span{.seconds = static_cast<double>(after.steady_ns - before.steady_ns) / 1e9,
                   .cpu_ms_by_thread = {}};
  for (const auto& [id, thread] : after.threads) {
    const auto earlier = before.threads.find(id);
    if (earlier == before.threads.end()) continue;
    const double cpu_ms = static_cast<double>(thread.cpu_ns - earlier->second.cpu_ns) / 1e6;
    span.cpu_ms += cpu_ms;
    span.cpu_ms_by_thread[thread.name] += cpu_ms;
    span.wakeups += static_cast<double>(thread.wakeups - earlier->second.wakeups);
  }
  return span;
}

std::optional<SyscallCounter> SyscallCounter::start(const ProcessReading& process) {
  const auto id = tracepoint();
  if (!id) return std::nullopt;
  perf_event_attr event{};
  event.size = sizeof event;
  event.type = PERF_TYPE_TRACEPOINT;
  event.config = *id;
  SyscallCounter counter;
  for (const auto& [thread, reading] : process.threads) {
    const long fd = syscall(SYS_perf_event_open, &event, thread, -1, -1, PERF_FLAG_FD_CLOEXEC);
    if (fd < 0) return std::nullopt;
    counter.counters_.emplace_back(static_cast<int>(fd));
  }
  return counter;
}

std::uint64_t SyscallCounter::calls() const {
  std::uint64_t sum = 0;
  for (const system::Descriptor& counter : counters_) {
    std::uint64_t calls = 0;
    if (read(counter.get(), &calls, sizeof calls) == sizeof calls) sum += calls;
  }
  return sum;
}

}  // namespace tandem::lab
