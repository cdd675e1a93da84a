#pragma once

#include <cstdint>
#include <string>

#include "services/host/host.hpp"
#include "services/process/service_notifier.hpp"
#include "services/standby/standby.hpp"

namespace tandem::daemon {

/// What systemd hears of a server: ready when it has announced its session, alive while its loop goes on, and
/// a line about the session for `systemctl status`.
class Service {
 public:
  /// Call it in every turn of the loop.
  void watch(const host::Host& host, std::int64_t now_ns);
  void watch(const standby::Standby& standby, const std::string& session, std::int64_t now_ns);
  [[nodiscard]] ServiceNotifier& notifier() { return notifier_; }

 private:
  ServiceNotifier notifier_;
  std::uint64_t told_frames_ = 0;
  std::int64_t told_ns_ = 0;
};

}  // namespace tandem::daemon
