#pragma once

#include <cstdint>
#include <string>

#include "services/host/host.hpp"
#include "services/host/keeping/keeping.hpp"
#include "services/process/service_notifier.hpp"
#include "services/standby/standby.hpp"
#include "services/tandemd/configuration/options.hpp"

namespace tandem::daemon {

/// What systemd and operators ask of a running server. systemd hears that it is ready when it has announced
/// its session, alive while its loop goes on, and a line about the session for `systemctl status`.
class Service {
 public:
  /// Call it in every turn of the loop.
  void watch(const host::Host& host, std::int64_t now_ns);
  void watch(const standby::Standby& standby, const std::string& session, std::int64_t now_ns);
  /// The same. If the configuration is to be read again, changes what can change live, and logs the fields
  /// that changed and those that cannot, or what is wrong.
  void reload(const Options& options, host::Host& host, host::Keeping& keeping, std::int64_t now_ns);

 private:
  ServiceNotifier notifier_;
  std::uint64_t told_frames_ = 0;
  std::int64_t told_ns_ = 0;
};

}  // namespace tandem::daemon
