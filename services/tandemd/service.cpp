#include "services/tandemd/service.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include "sdk/wire/units.hpp"
#include "services/tandemd/console.hpp"

namespace tandem::daemon {

void Service::watch(const host::Host& host, std::int64_t now_ns) {
  using State = host::Host::State;
  const State state = host.state();
  if (state != State::kWaiting && state != State::kRunning) return;
  notifier_.alive(now_ns);
  if (!notifier_.wants_status(now_ns)) return;
  if (state == State::kWaiting) {
    notifier_.tell(fmt::format("session '{}' waits for participants", host.session().session));
    return;
  }
  const std::uint64_t frames = host.totals().frames;
  const double rate_hz = told_ns_ == 0 ? 0
                                       : static_cast<double>(frames - told_frames_) * 1e9 /
                                             static_cast<double>(now_ns - told_ns_);
  notifier_.tell(fmt::format("session '{}', frame {}, {:.1f} frames/s, {} participants, {} observers{}",
                             host.session().session, host.frame(), rate_hz, host.participants(),
                             host.observers(), host.totals().hidden == 0 ? "" : ", " + hidden_text(host)));
  told_frames_ = frames;
  told_ns_ = now_ns;
}

void Service::watch(const standby::Standby& standby, const std::string& session, std::int64_t now_ns) {
  notifier_.alive(now_ns);
  if (!notifier_.wants_status(now_ns)) return;
  notifier_.tell(standby.holds() == 0
                     ? fmt::format("stands by for session '{}', and holds nothing yet", session)
                     : fmt::format("stands by for session '{}' from frame {}, {} frames behind", session,
                                   standby.holds(), standby.live_frame() - standby.holds()));
}

void Service::reload(DaemonOptions& options, host::Host& host, host::Keeping& keeping, std::int64_t now_ns) {
  const auto set_limits = [&host](std::uint32_t clients, std::optional<std::int64_t> stall_timeout_ns) {
    const auto set = host.set_limits(clients, stall_timeout_ns);
    if (!set) spdlog::error(set.error().message);  // cannot be: the configuration was checked
  };
  reload(options, set_limits, keeping, now_ns);
}

void Service::reload(DaemonOptions& options, host::HostConfig& config, host::Keeping& keeping,
                     std::int64_t now_ns) {
  const auto set_limits = [&config](std::uint32_t clients, std::optional<std::int64_t> stall_timeout_ns) {
    config.client_limit = clients;
    config.stall_timeout_ns = stall_timeout_ns;
  };
  reload(options, set_limits, keeping, now_ns);
}

void Service::reload(DaemonOptions& options, const SetLimits& set_limits, host::Keeping& keeping,
                     std::int64_t now_ns) {
  const auto changes = options.changes();
  if (!changes) return;
  notifier_.reloading(now_ns);
  if (!*changes) {
    spdlog::error("the configuration stays as it was: {}", changes->error().message);
  } else {
    const Changes& changed = **changes;
    std::optional<std::int64_t> stall_timeout_ns;
    if (changed.stall_timeout_s) stall_timeout_ns = static_cast<std::int64_t>(*changed.stall_timeout_s * 1e9);
    options.client_limit = changed.client_limit;
    options.stall_timeout_s = changed.stall_timeout_s;
    options.checkpoint.interval_s = changed.checkpoint_interval_s;
    set_limits(changed.client_limit, stall_timeout_ns);
    keeping.set_interval(changed.checkpoint_interval_s);
    if (!changed.live.empty()) spdlog::info("configuration: changed {}", fmt::join(changed.live, ", "));
    if (!changed.after_restart.empty())
      spdlog::warn("configuration: not changed, as this needs a restart: {}",
                   fmt::join(changed.after_restart, ", "));
    if (changed.live.empty() && changed.after_restart.empty()) spdlog::info("configuration: nothing changed");
  }
  notifier_.reloaded();
}

}  // namespace tandem::daemon
