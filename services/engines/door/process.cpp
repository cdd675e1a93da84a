#include "services/engines/door/process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <span>

namespace tandem::engine::door {
namespace {

constexpr std::size_t kMaxLine = 500;

// Only what may be called between fork() and exec().
[[noreturn]] void become(const char* command, char* const* environment, int output, pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);  // it ended meanwhile
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::signal(SIGPIPE, SIG_DFL);
  ::signal(SIGXFSZ, SIG_DFL);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(output, STDERR_FILENO);
  const std::array<const char*, 4> words{"sh", "-c", command, nullptr};
  ::execve("/bin/sh", const_cast<char* const*>(words.data()), environment);  // NOLINT: as execve(2) wants it
  ::_exit(127);
}

/// The letter of proc(5), such as T; 0: not known.
char state_of(pid_t process) {
  if (process <= 0) return 0;
  std::FILE* const file = std::fopen(fmt::format("/proc/{}/stat", process).c_str(), "re");
  if (file == nullptr) return 0;
  std::array<char, 512> text{};
  const std::size_t length = std::fread(text.data(), 1, text.size() - 1, file);
  std::fclose(file);
  const std::string_view stat(text.data(), length);
  const std::size_t name_end = stat.rfind(')');  // the name may hold anything
  return name_end == std::string_view::npos || name_end + 2 >= stat.size() ? '\0' : stat[name_end + 2];
}

void sleep_ms(long ms) {
  const timespec pause{.tv_sec = 0, .tv_nsec = ms * 1'000'000};
  ::nanosleep(&pause, nullptr);
}

}  // namespace

std::string quoted(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

Result<Process> Process::start(const std::string& command,
                               const std::vector<std::pair<std::string, std::string>>& environment) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC | O_NONBLOCK) != 0)
    return fail(ErrorCode::kIo, fmt::format("no pipe for the engine: {}", std::strerror(errno)));
  Process process;
  process.output_ = system::Descriptor(pipe[0]);
  const system::Descriptor theirs(pipe[1]);
  ::fcntl(pipe[1], F_SETFL, 0);  // the engine's own writes may wait
  std::vector<std::string> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string_view text(*variable);
    bool replaced = false;
    const std::string_view named = text.substr(0, text.find('='));
    for (const auto& [name, value] : environment) replaced = replaced || named == name;
    if (!replaced) variables.emplace_back(text);
  }
  for (const auto& [name, value] : environment) variables.emplace_back(name).append("=").append(value);
  std::vector<char*> list;
  list.reserve(variables.size() + 1);
  for (std::string& variable : variables) list.push_back(variable.data());
  list.push_back(nullptr);
  const pid_t parent = ::getpid();
  process.id_ = ::fork();
  if (process.id_ == 0) become(command.c_str(), list.data(), pipe[1], parent);
  if (process.id_ < 0)
    return fail(ErrorCode::kIo, fmt::format("the engine cannot be started: {}", std::strerror(errno)));
  ::setpgid(process.id_, process.id_);  // whichever of the two is first
  return process;
}

Process::Process(Process&& other) noexcept { *this = std::move(other); }

Process& Process::operator=(Process&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(output_, other.output_);
  std::swap(line_, other.line_);
  std::swap(last_, other.last_);
  return *this;
}

std::vector<std::string> Process::read() {
  std::vector<std::string> lines;
  std::array<char, 4096> bytes{};
  // Bounded, because an engine may write without end.
  for (int i = 0; i < 16 && output_.is_open(); ++i) {
    const ssize_t got = ::read(output_.get(), bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && errno == EAGAIN) break;
    if (got <= 0) output_ = {};
    for (const char c : std::span(bytes).first(got > 0 ? static_cast<std::size_t>(got) : 0)) {
      if (c != '\n' && line_.size() < kMaxLine) {
        if (c != '\r') line_ += c >= ' ' || c < 0 ? c : '?';
        continue;
      }
      if (c == '\n') lines.push_back(std::exchange(line_, {}));
    }
  }
  if (!output_.is_open() && !line_.empty()) lines.push_back(std::exchange(line_, {}));
  for (const std::string& line : lines) {
    if (last_.size() == kLastLines) last_.pop_front();
    last_.push_back(line);
  }
  return lines;
}

std::string Process::ended() {
  if (id_ <= 0) return {};
  siginfo_t how{};
  // It stays a zombie until end(), so that its number names nobody else.
  if (::waitid(P_PID, static_cast<id_t>(id_), &how, WEXITED | WNOHANG | WNOWAIT) != 0 || how.si_pid != id_)
    return {};
  return fmt::format("{} {}", how.si_code == CLD_EXITED ? "exit code" : "signal", how.si_status);
}

std::vector<std::string> Process::end(int patience_ms) {
  std::vector<std::string> lines;
  if (id_ <= 0) return lines;
  const auto take = [this, &lines] {
    for (std::string& line : read()) lines.push_back(std::move(line));
  };
  for (int waited = 0; waited < patience_ms && ended().empty(); waited += 5) {
    take();  // else it might wait for room in the pipe
    sleep_ms(5);
  }
  ::kill(-id_, SIGKILL);  // also what its first process left behind
  while (::waitpid(id_, nullptr, 0) < 0 && errno == EINTR) {
  }
  take();
  id_ = 0;
  return lines;
}

bool is_stopped(pid_t process) {
  const char state = state_of(process);
  return state == 'T' || state == 't';
}

bool is_gone(pid_t process) {
  if (process <= 0) return false;
  const char state = state_of(process);
  return state == 'Z' || state == 'X' || (state == 0 && ::kill(process, 0) != 0 && errno == ESRCH);
}

}  // namespace tandem::engine::door
