#include "services/relay/metrics.hpp"

namespace tandem::relay {

void FiguresNow::follows(const transport::ClientPort& port) {
  const auto counts = port.counts();
  if (!counts) return;
  if (!followed) followed.emplace();
  followed->asked += counts->asked;
  followed->repaired += counts->repaired;
  followed->resumed += counts->resumed;
  followed->given_up += counts->given_up;
  followed->malformed += counts->malformed;
}

void describe(metrics::Page& page, const std::string& session, const FiguresNow& figures) {
  const auto count = [&page](const char* name, const char* help, std::uint64_t value) {
    page.count(name, help, static_cast<double>(value));
  };
  page.gauge("tandem_relay_publishes", "1 while the session is passed on", figures.publishes ? 1 : 0);
  page.gauge("tandem_relay_stands_by",
             "1 while another relay passes the session on, and this one would take over",
             figures.stands_by ? 1 : 0);
  page.gauge("tandem_relay_clients", "Clients that play here", figures.clients);
  count("tandem_relay_begun_total", "Times that it began to pass on an epoch", figures.opened);
  count("tandem_relay_joins_total", "Times that it joined by a snapshot, all streams together",
        figures.joins);
  count("tandem_relay_frames_total", "Frames that were passed on in this epoch", figures.frames);
  count("tandem_relay_snapshots_total", "Snapshots made for clients in this epoch", figures.snapshots);
  count("tandem_relay_refused_inputs_total", "Inputs of clients that were refused in this epoch",
        figures.inputs_refused);
  count("tandem_relay_connections_lost_total",
        "Connections to NATS that were cut, by its server or by the network", figures.connections_lost);
  if (const auto& out = figures.published) {
    page.gauge("tandem_relay_followers", "Programs that follow it over NATS",
               static_cast<double>(out->followers));
    count("tandem_relay_published_bytes_total", "Bytes of packets to NATS", out->published_bytes);
    count("tandem_relay_published_packets_total", "Packets to NATS", out->published);
    count("tandem_relay_unpublished_total", "Messages that NATS did not take", out->unpublished);
    count("tandem_relay_asks_total", "Requests for what was lost", out->asks);
    count("tandem_relay_refused_asks_total",
          "Requests that were not answered, for their rate, their bytes or their epoch", out->asks_refused);
    count("tandem_relay_repeated_bytes_total", "Bytes that were sent again on request", out->repeated_bytes);
    count("tandem_relay_turned_away_total",
          "Messages of followers whose site has as many places as it may have", out->turned_away);
    count("tandem_relay_malformed_total", "Messages of followers that break a rule", out->malformed);
  }
  if (const auto& in = figures.followed) {
    count("tandem_relay_asked_total", "Requests that it made for what was lost on the way to it", in->asked);
    count("tandem_relay_repaired_total", "Messages that came on its requests", in->repaired);
    count("tandem_relay_resumed_total", "Streams that it went on with from the state that it kept",
          in->resumed);
    count("tandem_relay_given_up_frames_total", "Frames that could not be had any more", in->given_up);
    count("tandem_relay_malformed_received_total", "Messages of the relay before it that break a rule",
          in->malformed);
  }
  if (const auto& out = figures.audience) {
    count("tandem_relay_segments_total", "Segments that were written for the audience", out->segments);
    count("tandem_relay_written_bytes_total", "Bytes of segments, snapshots and manifests that were written",
          out->segment_bytes + out->snapshot_bytes + out->manifest_bytes);
    page.gauge("tandem_relay_object_bytes", "Bytes of the objects that are there for the audience",
               static_cast<double>(out->object_bytes));
  }
  metrics::describe(page, session, figures.client);
}

}  // namespace tandem::relay
