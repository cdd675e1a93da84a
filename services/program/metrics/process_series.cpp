#include "services/program/metrics/process_series.hpp"

#include <dirent.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

namespace tandem::metrics {
namespace {

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / 1e6;
}

double open_files() {
  DIR* const folder = opendir("/proc/self/fd");
  if (folder == nullptr) return 0;
  double count = -3;  // the folder itself, "." and ".."
  while (readdir(folder) != nullptr) ++count;
  closedir(folder);
  return count;
}

/// Seconds since 1970; 0 if /proc does not tell.
double start_time_s() {
  std::ifstream system("/proc/stat");
  double booted_s = 0;
  for (std::string word; system >> word;)
    if (word == "btime" && system >> booted_s) break;
  std::ifstream own("/proc/self/stat");
  const std::string text{std::istreambuf_iterator<char>(own), {}};
  // The second field is the program's name, which may hold anything.
  std::istringstream fields(text.substr(std::min(text.rfind(')') + 1, text.size())));
  constexpr int kStartTime = 20;  // the 22nd field, counted behind the name
  double ticks = 0;
  std::string skipped;
  for (int i = 1; i < kStartTime; ++i) fields >> skipped;
  fields >> ticks;
  return booted_s + ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

}  // namespace

void describe_process(Page& page) {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  page.count("process_cpu_seconds_total", "Processor time of the process",
             seconds(used.ru_utime) + seconds(used.ru_stime));
  double pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  page.gauge("process_resident_memory_bytes", "Memory of the process that is in use",
             resident * static_cast<double>(sysconf(_SC_PAGESIZE)));
#ifdef __GLIBC__
  // What stays here and not above is room that the heap keeps for later.
  const struct mallinfo2 heap = mallinfo2();
  page.gauge("tandem_heap_bytes", "Memory that the program has allocated and not freed",
             static_cast<double>(heap.uordblks) + static_cast<double>(heap.hblkhd));
#endif
  page.gauge("process_open_fds", "Open files and sockets", open_files());
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  page.gauge("process_max_fds", "Maximum number of open files and sockets",
             static_cast<double>(limit.rlim_cur));
  static const double started_s = start_time_s();
  page.gauge("process_start_time_seconds", "Start of the process, since 1970", started_s);
}

}  // namespace tandem::metrics
