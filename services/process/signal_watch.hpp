#pragma once
// SIGINT, SIGTERM and SIGHUP as a flag, and an end in time whatever a library waits for.

#include <atomic>
#include <chrono>
#include <csignal>
#include <string>
#include <thread>
#include <utility>

namespace tandem {

/// A thread waits for the signals, so that no handler and no global is needed. Make it before other threads:
/// its mask holds for those started later. SIGHUP counts unless the parent has it ignored, as nohup(1) does.
/// A file at its size limit (SIGXFSZ) is an error of the write, and does not end the process.
///
/// The same thread is the guard of the end. Cyclone DDS, when it stops, waits for a packet to itself, which
/// never comes once the network interface is gone. So from the first signal, or from finish() where that is
/// earlier, the program has a limited time until this object is destroyed. After that, or at a further signal
/// that comes a while after the first, the thread says on stderr what was left and ends the process with
/// _exit().
class SignalWatch {
 public:
  struct Limits {
    /// For an orderly end; a program that is asked to end does so within 5 s.
    std::chrono::milliseconds end{4000};
    /// Another signal within this time of the first counts as the same request, because a terminal with a
    /// parent process, or timeout(1), sends two at once.
    std::chrono::milliseconds repeat{1000};
  };

  /// `program` stands in front of what the guard says.
  explicit SignalWatch(std::string program) : SignalWatch(std::move(program), Limits()) {}
  SignalWatch(std::string program, Limits limits);
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  SignalWatch(SignalWatch&&) = delete;
  SignalWatch& operator=(SignalWatch&&) = delete;

  [[nodiscard]] const std::atomic<bool>& stop() const { return stop_; }

  /// All work is done, reports and files are written, and only DDS is left to end: from now on `exit_code` is
  /// that of the process, also when the guard ends it; before it would be 1. Flushes stdout, as _exit() does
  /// not. Returns `exit_code`, or 1 when stdout took not all.
  [[nodiscard]] int finish(int exit_code);

 private:
  static constexpr int kAtWork = -1;

  void run();
  /// The thread looks again at what it waits for.
  void wake();
  /// Ends the process. `when`: in words, behind "had not ended".
  [[noreturn]] void give_up(const std::string& when) const;

  const std::string program_;
  const Limits limits_;
  sigset_t signals_{};
  std::atomic<bool> stop_{false}, done_{false};
  std::atomic<int> exit_code_{kAtWork};
  std::thread thread_;
};

}  // namespace tandem
