#include "services/gateway/metrics.hpp"

namespace tandem::gateway {

void describe(metrics::Page& page, const std::string& session, const FiguresNow& figures) {
  const Counts& counts = figures.counts;
  const auto count = [&page](const char* name, const char* help, std::uint64_t value) {
    page.count(name, help, static_cast<double>(value));
  };
  page.gauge("tandem_gateway_viewers", "Viewers that are connected", static_cast<double>(figures.viewers));
  count("tandem_gateway_viewers_joined_total", "Viewers that were admitted", counts.joined);
  count("tandem_gateway_viewers_left_total", "Admitted viewers that left, for whatever reason", counts.left);
  for (std::size_t i = 0; i < kClosings.size(); ++i) {
    page.count("tandem_gateway_refusals_total", "Connections that were refused or ended, by reason",
               static_cast<double>(counts.refused[i]), {{"reason", std::string(kClosings[i].label)}});
  }
  for (std::size_t i = 0; i < kTurnedAwayLabels.size(); ++i) {
    page.count("tandem_gateway_turned_away_total",
               "Connections and requests that were turned away before they were a viewer's, by reason",
               static_cast<double>(counts.turned_away[i]), {{"reason", std::string(kTurnedAwayLabels[i])}});
  }
  count("tandem_gateway_sent_messages_total", "Messages to viewers", counts.messages);
  count("tandem_gateway_sent_bytes_total", "Bytes of messages to viewers", counts.bytes);
  count("tandem_gateway_snapshots_total", "Snapshots made for viewers", counts.snapshots);
  count("tandem_gateway_viewers_behind_total", "Times that a viewer fell behind and got a snapshot",
        counts.skips);
  count("tandem_gateway_viewers_resumed_total",
        "Viewers that went on without a snapshot after another connection was lost", counts.resumed);
  count("tandem_gateway_inputs_total", "Inputs of viewers", counts.inputs);
  count("tandem_gateway_sent_inputs_total", "Inputs that were passed on to the server", counts.inputs_sent);
  count("tandem_gateway_refused_inputs_total", "Inputs of viewers that were refused", counts.inputs_refused);
  count("tandem_gateway_stale_messages_total", "Messages of viewers for another epoch or stream",
        counts.stale);
  metrics::describe(page, session, figures.client);
}

}  // namespace tandem::gateway
