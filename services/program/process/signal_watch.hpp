#pragma once
// Turns SIGINT, SIGTERM and SIGHUP into flags, and ends the process in time even if a library waits for ever,
// or is broken.

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <utility>

namespace tandem {

/// What a program does when a library of its process is broken, so that only a new process can go on.
struct Fault {
  /// The guard's thread asks this about once in 2 s. Empty: nothing is broken.
  std::function<std::string()> reason;
  /// Gets the reason, once.
  std::function<void(const std::string&)> log;
  /// True: the process ends with 1 at once, as if it had crashed, so that nobody takes it for a wish to end.
  /// False: as after a signal, but the exit code is not 0.
  bool at_once = false;
  /// Asked as `reason`: why the program is of no use before it is started anew, though nothing is broken. It
  /// then ends as after a signal, but the exit code is not 0.
  std::function<std::string()> outdated = {};
};

/// A thread waits for the signals, so no handler and no global is needed. Make this object before other
/// threads are started, because they inherit its mask. SIGHUP counts unless the parent has it ignored, as
/// nohup(1) does; it is a wish to end or, if the program asks for that and has not just lost its terminal, to
/// read its configuration again. A file at its size limit (SIGXFSZ) is an error of the write, and does not
/// end the process.
///
/// The same thread is the guard of the end, which a library such as Cyclone DDS could keep for ever. So from
/// the first signal, or from finish() if that is earlier, the program has a limited time until this object is
/// destroyed. After that, or at a further signal that comes a while after the first, the thread says on
/// stderr what was left and ends the process with _exit().
class SignalWatch {
 public:
  struct Limits {
    /// Time for an orderly end; a program that is asked to end does so within 5 s.
    std::chrono::milliseconds end{4000};
    /// Another signal within this time of the first counts as the same request, because a terminal with a
    /// parent process, or timeout(1), sends two at once.
    std::chrono::milliseconds repeat{1000};
  };

  /// What SIGHUP asks for.
  enum class Hangup : std::uint8_t { kStop, kReload };

  /// The guard's messages begin with `program`.
  explicit SignalWatch(std::string program, Hangup hangup = Hangup::kStop, Fault fault = {})
      : SignalWatch(std::move(program), Limits(), hangup, std::move(fault)) {}
  SignalWatch(std::string program, Limits limits, Hangup hangup = Hangup::kStop, Fault fault = {});
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  [[nodiscard]] const std::atomic<bool>& stop() const { return stop_; }
  /// True once after one or more SIGHUP that ask to reload.
  [[nodiscard]] bool take_reload() { return reload_.exchange(false, std::memory_order_relaxed); }

  /// Call when all work is done, reports and files are written, and only DDS still has to end. From now on
  /// the process exits with `exit_code` even if the guard ends it; before, that would be 1. Flushes stdout,
  /// because _exit() does not. Returns `exit_code`, or 1 instead of 0 if stdout did not take everything or
  /// there was a fault.
  [[nodiscard]] int finish(int exit_code);

 private:
  static constexpr int kAtWork = -1;

  void run();
  /// True until there is a fault, or the work is done.
  [[nodiscard]] bool looks() const;
  /// Asks whether there is a fault, if it is time to. Returns true once, when there is one.
  bool take_fault();
  /// The thread looks again at what it waits for.
  void wake();
  /// Ends the process. `when` follows the words "had not ended".
  [[noreturn]] void give_up(const std::string& when) const;

  const std::string program_;
  const Limits limits_;
  const Hangup hangup_;
  const Fault fault_;
  const bool had_terminal_;
  sigset_t signals_{};
  std::atomic<bool> stop_{false}, reload_{false}, done_{false}, faulty_{false};
  std::atomic<int> exit_code_{kAtWork};
  std::chrono::steady_clock::time_point next_look_{};  // of the thread
  std::thread thread_;
};

}  // namespace tandem
