#include "services/host/outgoing/publisher.hpp"

#include <chrono>
#include <utility>

namespace tandem::host {

using namespace std::chrono_literals;

Publisher::Publisher(Outbox& outbox, transport::ServerPort& port, std::chrono::nanoseconds patience)
    : outbox_(&outbox),
      port_(&port),
      patience_(patience),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

void Publisher::flush() const {
  constexpr int kMaxTicks = 200;
  constexpr std::chrono::milliseconds kTick(5);
  for (int i = 0; i < kMaxTicks && outbox_->size() > 0 && !gave_up(); ++i) std::this_thread::sleep_for(kTick);
}

void Publisher::stop() {
  thread_.request_stop();
  outbox_->wake();
  if (thread_.joinable()) thread_.join();
}

void Publisher::run(const std::stop_token& stop) {
  using Clock = std::chrono::steady_clock;
  std::chrono::nanoseconds frame_took{0};
  while (!stop.stop_requested() && !gave_up()) {
    const auto message = outbox_->pop(100ms);
    port_->show_life();
    if (!message) continue;
    if (std::holds_alternative<EndOfFrame>(*message)) {
      durations_.add(std::exchange(frame_took, 0ns).count());
      continue;
    }
    // A delta or a scheduled input that is lost would send every client back to joining.
    const bool precious = std::holds_alternative<transport::DeltaMessage>(*message) ||
                          std::holds_alternative<transport::ScheduledInputMessage>(*message) ||
                          std::holds_alternative<transport::SessionMessage>(*message);
    if (std::holds_alternative<transport::DeltaMessage>(*message)) {
      const auto began = Clock::now();
      insist(*message, stop);
      frame_took += Clock::now() - began;
    } else if (precious) {
      insist(*message, stop);
    } else {
      write(*message);
    }
  }
}

void Publisher::insist(const Outgoing& message, const std::stop_token& stop) {
  using Clock = std::chrono::steady_clock;
  std::optional<Clock::time_point> refused_since;
  while (const auto failed = write(message)) {
    if (stop.stop_requested()) return;
    if (failed == ErrorCode::kTimeout) {
      refused_since.reset();
    } else if (!refused_since) {
      refused_since = Clock::now();
    } else if (Clock::now() - *refused_since >= patience_) {
      gave_up_.store(true, std::memory_order_relaxed);
      return;
    }
    std::this_thread::sleep_for(5ms);
  }
}

std::optional<ErrorCode> Publisher::write(const Outgoing& message) {
  const auto written = publish(*port_, message);
  if (written) return std::nullopt;
  {
    const std::scoped_lock lock(mutex_);
    last_failure_ = written.error().message;
  }
  failures_.fetch_add(1, std::memory_order_relaxed);
  return written.error().code;
}

std::string Publisher::last_failure() const {
  const std::scoped_lock lock(mutex_);
  return last_failure_;
}

}  // namespace tandem::host
