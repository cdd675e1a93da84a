#include "services/program/process/service_notifier.hpp"

#include <cstdlib>

#ifdef TANDEM_HAVE_SYSTEMD
#include <systemd/sd-daemon.h>
#endif

namespace tandem {

#ifdef TANDEM_HAVE_SYSTEMD

ServiceNotifier::ServiceNotifier() : listened_(std::getenv("NOTIFY_SOCKET") != nullptr) {
  std::uint64_t watchdog_us = 0;
  if (sd_watchdog_enabled(0, &watchdog_us) > 0)
    period_ns_ = static_cast<std::int64_t>(watchdog_us) * 1000 / 4;
}

void ServiceNotifier::send(const std::string& state) const {
  // A lost message is nothing that a program could mend.
  if (listened_) static_cast<void>(sd_notify(0, state.c_str()));
}

#else

ServiceNotifier::ServiceNotifier() = default;
void ServiceNotifier::send(const std::string& /*state*/) const {}

#endif

ServiceNotifier::~ServiceNotifier() {
  if (ready_) send("STOPPING=1");
}

void ServiceNotifier::starting(const std::string& status, std::int64_t now_ns) {
  if (ready_ || !wants_status(now_ns)) return;
  send("EXTEND_TIMEOUT_USEC=" + std::to_string(kStartExtensionNs / 1000) + "\nSTATUS=" + status);
}

void ServiceNotifier::alive(std::int64_t now_ns) {
  if (!ready_) {
    ready_ = true;
    send("READY=1");
  }
  if (period_ns_ == 0 || now_ns < next_alive_ns_) return;
  next_alive_ns_ = now_ns + period_ns_;
  send("WATCHDOG=1");
}

bool ServiceNotifier::wants_status(std::int64_t now_ns) {
  if (!listened_ || now_ns < next_status_ns_) return false;
  next_status_ns_ = now_ns + kStatusPeriodNs;
  return true;
}

void ServiceNotifier::tell(const std::string& status) { send("STATUS=" + status); }

void ServiceNotifier::reloading(std::int64_t now_ns) {
  send("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(now_ns / 1000));
}

void ServiceNotifier::reloaded() { send("READY=1"); }

}  // namespace tandem
