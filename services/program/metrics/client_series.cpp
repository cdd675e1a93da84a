#include "services/program/metrics/client_series.hpp"

#include "services/program/metrics/figure_series.hpp"

namespace tandem::metrics {

void describe(Page& page, const std::string& session, const ClientNow& now) {
  page.gauge("tandem_client_session_info", "The session that this client follows, as a label", 1,
             {{"session", session}});
  page.state("tandem_client_state", "1 for the state of this client",
             {"searching", "refused", "joining", "playing"}, static_cast<std::size_t>(now.status.phase));
  page.gauge("tandem_client_server_alive", "1 while DDS knows the session's server",
             now.status.server_alive ? 1 : 0);
  page.gauge("tandem_client_frame", "Number of the last frame that was applied",
             static_cast<double>(now.status.frame));
  page.gauge("tandem_client_frame_rate_target_hertz", "Frames per second of the session",
             now.status.frame_rate_hz);
  page.gauge(
      "tandem_client_lag_seconds",
      "From publishing a frame to applying it, over about half a second; needs one clock for both hosts",
      now.lag_s);
  describe(page, static_cast<const ClientFigures&>(now.status));
}

void ClientWatch::saw(const ClientStatus& status, std::int64_t now_ns) {
  frames_.saw(status.frames_applied, now_ns);
  switch (status.phase) {
    case ClientPhase::kSearching:
      obstacle_ = "it looks for the session";
      break;
    case ClientPhase::kRefused:
      obstacle_ = "it cannot play the session that is there";
      break;
    case ClientPhase::kJoining:
      obstacle_ = "it joins the session";
      break;
    case ClientPhase::kPlaying:
      obstacle_ = frames_.per_second() > 0 ? nullptr : "no frame has come for three seconds";
      break;
  }
  if (status.phase == ClientPhase::kPlaying && !status.server_alive)
    obstacle_ = "the session's server is gone";
}

}  // namespace tandem::metrics
