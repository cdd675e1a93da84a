#pragma once
// Tells systemd how a program is that it started: ready, alive, reloading, stopping.

#include <cstdint>
#include <string>

namespace tandem {

/// For a unit of Type=notify (sd_notify(3)). Where systemd did not start the program, or without libsystemd,
/// nothing is sent. Calls cost a system call at most, and never wait. Not thread-safe.
class ServiceNotifier {
 public:
  static constexpr std::int64_t kStatusPeriodNs = 5'000'000'000;
  static constexpr std::int64_t kStartExtensionNs = 30'000'000'000;

  ServiceNotifier();
  ~ServiceNotifier();  ///< says that the program stops, if it was ready
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;

  /// Call it often while the program waits for something that it needs, before the first alive(): systemd
  /// then goes on waiting for the start. `status` is the line for `systemctl status`.
  void starting(const std::string& status, std::int64_t now_ns);
  /// Call it in the program's loop once it serves. The first call says that it is ready. The others say that
  /// it is alive, four times in the unit's WatchdogSec=, after which systemd restarts a program that hangs.
  /// `now_ns` is a steady clock.
  void alive(std::int64_t now_ns);
  /// True every kStatusPeriodNs, and only if somebody reads the status.
  [[nodiscard]] bool wants_status(std::int64_t now_ns);
  /// A line for `systemctl status`.
  void tell(const std::string& status);
  /// Around the reading of a changed configuration.
  void reloading(std::int64_t now_ns);
  void reloaded();

 private:
  void send(const std::string& state) const;

  bool listened_ = false, ready_ = false;
  std::int64_t period_ns_ = 0;  // of the watchdog; 0: none
  std::int64_t next_alive_ns_ = 0, next_status_ns_ = 0;
};

}  // namespace tandem
