// tandemd: simulates a scene and streams it. Exit 0 done, 1 failed, 2 wrong usage.

#include <pthread.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <csignal>
#include <ctime>
#include <exception>
#include <thread>

#include "services/heap/heap.hpp"
#include "services/tandemd/command_line.hpp"
#include "services/tandemd/daemon.hpp"

namespace {

/// Turns SIGINT and SIGTERM into a flag. A thread waits for them, so that no handler and no global is needed.
class SignalWatch {
 public:
  SignalWatch() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);  // inherited by all threads started from here on
    thread_ = std::jthread([this](const std::stop_token& done) {
      constexpr timespec kTick{.tv_sec = 0, .tv_nsec = 50'000'000};
      while (!done.stop_requested()) {
        if (sigtimedwait(&signals_, nullptr, &kTick) > 0) stop_.store(true, std::memory_order_relaxed);
      }
    });
  }
  [[nodiscard]] const std::atomic<bool>& stop() const { return stop_; }

 private:
  sigset_t signals_{};
  std::atomic<bool> stop_{false};
  std::jthread thread_;
};

}  // namespace

int main(int argc, char** argv) {
  try {
    spdlog::set_default_logger(spdlog::stderr_color_mt("tandemd"));
    const auto command = tandem::daemon::parse_command_line(argc, argv);
    if (!command.options) return command.exit_code;
    const SignalWatch signals;  // first: its mask holds for all threads
    const tandem::HeapTrimmer trimmer;
    return tandem::daemon::run_daemon(*command.options, signals.stop());
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return 1;
  }
}
