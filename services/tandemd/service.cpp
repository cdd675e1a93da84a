#include "services/tandemd/service.hpp"

#include <fmt/format.h>

#include "sdk/transport/units.hpp"

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
  notifier_.tell(fmt::format("session '{}', frame {}, {:.1f} frames/s, {} participants, {} observers",
                             host.session().session, host.frame(), rate_hz, host.participants(),
                             host.observers()));
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

}  // namespace tandem::daemon
