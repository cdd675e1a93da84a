#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "services/host/host.hpp"
#include "services/host/keeping/keeping.hpp"
#include "services/host/standby/standby.hpp"
#include "services/program/process/service_notifier.hpp"
#include "services/tandemd/configuration/options.hpp"

namespace tandem::daemon {

/// What systemd and operators ask of a running server. systemd hears that it is ready when it has announced
/// its session, alive while its loop goes on, and a line about the session for `systemctl status`.
class Service {
 public:
  /// Call it in every turn of the loop.
  void watch(const host::Host& host, std::int64_t now_ns);
  void watch(const standby::Standby& standby, const std::string& session, std::int64_t now_ns);
  /// The same, while the first engine is awaited.
  void await_engine(std::int64_t now_ns) { notifier_.starting("waits for its engine", now_ns); }
  /// The same, while another engine is awaited, or the engine saves or loads.
  void watch(std::int64_t now_ns) { notifier_.alive(now_ns); }
  /// The same. If the configuration is to be read again, changes what can change live, also in `options`, and
  /// logs the fields that changed and those that cannot, or what is wrong.
  void reload(DaemonOptions& options, host::Host& host, host::Keeping& keeping, std::int64_t now_ns);
  /// The same while it stands by: `config` is that of a later takeover.
  void reload(DaemonOptions& options, host::HostConfig& config, host::Keeping& keeping, std::int64_t now_ns);

 private:
  /// Sets the limit of clients and the stall timeout.
  using SetLimits = std::function<void(std::uint32_t, std::optional<std::int64_t>)>;
  void reload(DaemonOptions& options, const SetLimits& set_limits, host::Keeping& keeping,
              std::int64_t now_ns);

  ServiceNotifier notifier_;
  std::uint64_t told_frames_ = 0;
  std::int64_t told_ns_ = 0;
};

}  // namespace tandem::daemon
