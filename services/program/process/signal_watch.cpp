#include "services/program/process/signal_watch.hpp"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <optional>

namespace tandem {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook = 2s;

/// Returns the signal; 0 for this program's own wake-up, which has `mark`, for a stop that is over, and at
/// `deadline`.
int wait_for_signal(const sigset_t& signals, const void* mark,
                    const std::optional<Clock::time_point>& deadline) {
  siginfo_t info{};
  int signal = -1;
  if (deadline) {
    const std::chrono::nanoseconds left = std::max<std::chrono::nanoseconds>(0ns, *deadline - Clock::now());
    timespec timeout{};
    timeout.tv_sec = static_cast<std::time_t>(left / 1s);
    timeout.tv_nsec = static_cast<long>((left % 1s).count());
    signal = sigtimedwait(&signals, &info, &timeout);
  } else {
    signal = sigwaitinfo(&signals, &info);
  }
  const bool own = info.si_code == SI_QUEUE && info.si_value.sival_ptr == mark;
  return own ? 0 : std::max(signal, 0);
}

/// Whether a terminal controls this process, and is still there.
bool has_terminal() {
  const int terminal = open("/dev/tty", O_RDONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (terminal >= 0) close(terminal);
  return terminal >= 0;
}

/// Seconds, with a decimal only where there is one.
std::string seconds_text(std::chrono::milliseconds time) {
  char text[32];
  std::snprintf(text, sizeof text, "%g s", std::chrono::duration<double>(time).count());
  return text;
}

}  // namespace

SignalWatch::SignalWatch(std::string program, Limits limits, Hangup hangup, Fault fault)
    : program_(std::move(program)),
      limits_(limits),
      hangup_(hangup),
      fault_(std::move(fault)),
      had_terminal_(has_terminal()) {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  // nohup(1) has it ignored; blocked, it would be taken all the same.
  struct sigaction former {};
  sigaction(SIGHUP, nullptr, &former);
  if (former.sa_handler != SIG_IGN) sigaddset(&signals_, SIGHUP);
  std::signal(SIGXFSZ, SIG_IGN);
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);  // inherited by all threads started from here on
  thread_ = std::thread([this] { run(); });
}

SignalWatch::~SignalWatch() {
  done_ = true;
  wake();
  thread_.join();
}

int SignalWatch::finish(int exit_code) {
  const bool told = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if ((!told || faulty_) && exit_code == 0) exit_code = 1;
  exit_code_ = exit_code;
  wake();
  return exit_code;
}

void SignalWatch::wake() {
  sigval mark{};
  mark.sival_ptr = this;
  pthread_sigqueue(thread_.native_handle(), SIGTERM, mark);  // blocked in every thread: it ends the wait only
}

bool SignalWatch::looks() const { return fault_.reason && !faulty_ && exit_code_ == kAtWork; }

bool SignalWatch::take_fault() {
  if (!looks() || Clock::now() < next_look_) return false;
  next_look_ = Clock::now() + kLook;
  std::string reason = fault_.reason();
  const bool broken = !reason.empty();
  if (!broken && fault_.outdated) reason = fault_.outdated();
  if (reason.empty()) return false;
  fault_.log(reason);
  if (broken && fault_.at_once) _exit(1);
  faulty_ = true;
  return true;
}

void SignalWatch::run() {
  std::optional<Clock::time_point> signalled, deadline;
  for (;;) {
    std::optional<Clock::time_point> until = deadline;
    if (looks()) until = deadline ? std::min(*deadline, next_look_) : next_look_;
    const int signal = wait_for_signal(signals_, this, until);
    if (done_) return;
    if (take_fault()) {
      stop_.store(true, std::memory_order_relaxed);
      if (!signalled) signalled = Clock::now();
    }
    const bool lost_terminal = signal == SIGHUP && had_terminal_ && !has_terminal();
    const bool reload = signal == SIGHUP && hangup_ == Hangup::kReload && !lost_terminal;
    if (reload) reload_.store(true, std::memory_order_relaxed);
    const bool asked = signal > 0 && !reload;
    const Clock::time_point now = Clock::now();
    if (asked && signalled && now - *signalled >= limits_.repeat) give_up("when a further signal came");
    if (asked && !signalled) signalled = now;
    if (asked) stop_.store(true, std::memory_order_relaxed);
    if (deadline && now >= *deadline)
      give_up(seconds_text(limits_.end) + (faulty_     ? " after the fault"
                                           : signalled ? " after the signal"
                                                       : " after the work was done"));
    if (!deadline && (signalled || exit_code_ != kAtWork)) deadline = now + limits_.end;
  }
}

void SignalWatch::give_up(const std::string& when) const {
  const int code = exit_code_;
  std::string line = program_;
  if (code == kAtWork) {
    line += ": the work had not ended " + when +
            ". The program stopped it: reports are missing, and files may lack their end.\n";
  } else {
    line += ": DDS had not ended " + when +
            " (is the network interface gone?). The program ended without it, with exit code " +
            std::to_string(code) +
            ". Reports and files were finished before; other programs may not have heard that it left, until "
            "its lease runs out.\n";
  }
  // Neither a held lock nor a stuck reader may keep the process alive.
  pollfd out{STDERR_FILENO, POLLOUT, 0};
  if (poll(&out, 1, 0) == 1 && (out.revents & POLLOUT) != 0) {
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, line.data(), line.size());
  }
  _exit(code == kAtWork ? 1 : code);
}

}  // namespace tandem
