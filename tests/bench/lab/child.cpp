#include "tests/bench/lab/child.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <utility>

#include "services/lab/measures/replay.hpp"

extern char** environ;

namespace tandem::lab {
namespace {

tl::unexpected<Error> failure(const std::string& what) {
  return fail(ErrorCode::kIo, fmt::format("{}: {}", what, std::strerror(errno)));
}

/// Everything that exec needs, made before the fork: afterwards nothing may allocate.
struct Prepared {
  explicit Prepared(const std::vector<std::string>& arguments, const ChildPlace& place) {
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    static constexpr char kName[] = "CYCLONEDDS_URI=";
    config = kName + place.dds_config;
    for (char** variable = environ; *variable != nullptr; ++variable) {
      const bool replaced =
          !place.dds_config.empty() && std::strncmp(*variable, kName, sizeof kName - 1) == 0;
      if (!replaced) envp.push_back(*variable);
    }
    if (!place.dds_config.empty()) envp.push_back(config.data());
    envp.push_back(nullptr);
  }
  std::vector<char*> argv, envp;
  std::string config;
};

[[noreturn]] void become(const Prepared& program, const ChildPlace& place, int out, pid_t parent) {
  constexpr int kFailed = 127;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kFailed);
  if (place.name_space >= 0 && setns(place.name_space, CLONE_NEWNET) != 0) _exit(kFailed);
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  dup2(nothing, STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(nothing, STDERR_FILENO);
  if (!place.cgroup_procs.empty()) {
    const int procs = open(place.cgroup_procs.c_str(), O_WRONLY | O_CLOEXEC);
    if (procs < 0 || write(procs, "0", 1) != 1) _exit(kFailed);
  }
  execve(program.argv[0], program.argv.data(), program.envp.data());
  _exit(kFailed);
}

}  // namespace

std::string own_path() { return std::filesystem::read_symlink("/proc/self/exe").string(); }

Result<Child> Child::start(const std::vector<std::string>& arguments, const ChildPlace& place) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return failure("pipe");
  system::Descriptor out(ends[0]);
  const system::Descriptor in(ends[1]);
  const Prepared program(arguments, place);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) return failure("fork");
  if (pid == 0) become(program, place, in.get(), parent);
  return Child(pid, std::move(out));
}

Child::Child(Child&& other) noexcept : pid_(std::exchange(other.pid_, -1)), out_(std::move(other.out_)) {}
Child::~Child() { kill_it(); }

void Child::kill_it() {
  if (pid_ <= 0) return;
  kill(pid_, SIGKILL);
  while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
}

Result<std::string> Child::finish(std::chrono::seconds at_most, const std::atomic<bool>& stop,
                                  int most_status) {
  const std::int64_t until_ns = steady_ns() + std::chrono::nanoseconds(at_most).count();
  std::string said;
  for (;;) {
    const std::int64_t left_ms = (until_ns - steady_ns()) / 1'000'000;
    if (stop || left_ms <= 0) {
      kill_it();
      if (stop) return fail(ErrorCode::kIo, "stopped");
      return fail(ErrorCode::kIo, fmt::format("it did not answer within {} s", at_most.count()));
    }
    pollfd ready{out_.get(), POLLIN, 0};
    if (poll(&ready, 1, static_cast<int>(std::min<std::int64_t>(left_ms, 200))) <= 0) continue;
    std::array<char, 4096> buffer{};
    const ssize_t size = read(out_.get(), buffer.data(), buffer.size());
    if (size <= 0) break;
    said.append(buffer.data(), static_cast<std::size_t>(size));
  }
  int status = 0;
  rusage used{};
  while (wait4(pid_, &status, 0, &used) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  for (const timeval& part : {used.ru_utime, used.ru_stime})
    cpu_ms_ += 1e3 * static_cast<double>(part.tv_sec) + 1e-3 * static_cast<double>(part.tv_usec);
  if (!WIFEXITED(status)) return fail(ErrorCode::kIo, fmt::format("signal {} ended it", WTERMSIG(status)));
  if (WEXITSTATUS(status) > most_status)
    return fail(ErrorCode::kIo, fmt::format("it ended with exit code {}", WEXITSTATUS(status)));
  return said;
}

}  // namespace tandem::lab
