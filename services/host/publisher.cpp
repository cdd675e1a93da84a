#include "services/host/publisher.hpp"

#include <chrono>

namespace tandem::host {

using namespace std::chrono_literals;

Publisher::Publisher(Outbox& outbox, transport::ServerPort& port)
    : outbox_(&outbox), port_(&port), thread_([this](const std::stop_token& stop) { run(stop); }) {}

void Publisher::stop() {
  thread_.request_stop();
  outbox_->wake();
  if (thread_.joinable()) thread_.join();
}

void Publisher::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const auto message = outbox_->pop(100ms);
    if (!message) continue;
    // A delta or a scheduled input that is lost would send every client back to joining.
    const bool precious = std::holds_alternative<transport::DeltaMessage>(*message) ||
                          std::holds_alternative<transport::ScheduledInputMessage>(*message) ||
                          std::holds_alternative<transport::SessionMessage>(*message);
    while (!write(*message) && precious && !stop.stop_requested()) std::this_thread::sleep_for(5ms);
  }
}

bool Publisher::write(const Outgoing& message) {
  const auto written = publish(*port_, message);
  if (written) return true;
  failures_.fetch_add(1, std::memory_order_relaxed);
  const std::scoped_lock lock(mutex_);
  last_failure_ = written.error().message;
  return false;
}

std::string Publisher::last_failure() const {
  const std::scoped_lock lock(mutex_);
  return last_failure_;
}

}  // namespace tandem::host
