#pragma once
// The metrics of tandem-relay: --metrics.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "sdk/wire/port.hpp"
#include "services/follow/audience/writer.hpp"
#include "services/program/metrics/client_series.hpp"
#include "services/program/metrics/page.hpp"

namespace tandem::relay {

/// Figures of a moment, as one thread hands them to the other.
struct FiguresNow {
  bool publishes = false, stands_by = false;
  std::uint64_t opened = 0, joins = 0;  ///< times that it began to publish; snapshots that it joined by
  std::uint64_t frames = 0, snapshots = 0, inputs_refused = 0;
  std::uint32_t clients = 0;
  std::uint64_t connections_lost = 0;                   ///< to NATS, of both sides
  std::optional<transport::PublishedCounts> published;  ///< to NATS
  std::optional<transport::FollowedCounts> followed;    ///< from NATS
  std::optional<audience::Writer::Totals> audience;     ///< of the folder
  metrics::ClientNow client;

  /// Adds what a port counts, if it is one from NATS.
  void follows(const transport::ClientPort& port);
};

/// The page of such figures, apart from what metrics/ adds for every program.
void describe(metrics::Page& page, const std::string& session, const FiguresNow& figures);

}  // namespace tandem::relay
