#pragma once
// A publish-subscribe network in memory, with a manual clock and seeded delay, loss and matching.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "sdk/transport/port.hpp"
#include "sdk/transport/simulated/bottleneck.hpp"

namespace tandem::transport::simulated {

/// So long after a reader could have seen a gap it asks: the delay of a NACK, and half a heartbeat's period.
inline constexpr std::int64_t kNackNs = 20'000'000;

/// How samples travel from one participant to another.
struct LinkModel {
  std::int64_t delay_ns = 1'000'000;
  std::int64_t jitter_ns = 0;  ///< added uniformly; order within a topic and writer is kept nevertheless
  double loss = 0;             ///< chance that one transmission is lost, first or repeated
  /// A lost sample of a reliable topic is sent again after this, if it is still kept. Empty: once a later one
  /// could have shown the gap, the reader asks kNackNs later, and both ways take what their links take.
  std::optional<std::int64_t> repair_ns = {};
  double lost_for_good = 0;  ///< chance that a lost sample of a reliable topic is never repaired
  /// What all samples have to pass, also those of other paths that name the same one; what it drops is lost.
  /// Null: room for everything.
  std::shared_ptr<Bottleneck> bottleneck = nullptr;
  /// Share of transmissions that are lost in a row, besides, and how many such a row has on average; less
  /// than 1, at least 1. Rows do not end by themselves while nothing is sent.
  double burst_loss = 0, burst_samples = 1;
  /// Chance that a transmission comes twice. DDS hands it over once; the bottleneck has to take both.
  double duplicates = 0;
};

struct NetworkOptions {
  std::uint64_t seed = 1;
  LinkModel link;  ///< of all links without one of their own
  /// A writer and a reader find each other after a time in this range, drawn for every pair.
  std::int64_t match_min_ns = 1'000'000, match_max_ns = 20'000'000;
  /// On top of that what the links take: one way for the news of an endpoint, a round trip before that for
  /// two participants who never met, and the repair of what is lost of these.
  bool match_over_links = false;
  /// A frozen, killed or cut-off peer counts as dead after this.
  std::int64_t lease_ns = 1'000'000'000;
};

/// What happened to samples on the way, for tests that want to know whether they tested anything.
struct NetworkCounts {
  std::uint64_t delivered = 0;
  std::uint64_t repaired = 0;
  std::uint64_t duplicated = 0;
  std::uint64_t overtaken = 0;    ///< of a best-effort topic, which hands over nothing older than what it did
  std::uint64_t overwritten = 0;  ///< gone from the writer's history before their repair
  std::uint64_t lost_for_good = 0;
  std::uint64_t pushed_out = 0;  ///< of a reader that did not take in time
};

class Fabric;

/// Makes ports and moves the clock. The same calls with the same seed give the same deliveries.
///
/// The rules are those of DDS as the ports in dds/ use it: order is kept within a topic and writer and
/// nowhere else; a lost sample holds up later ones of its topic and writer until it is repaired or gone;
/// where a topic is best effort, what was overtaken is dropped;
/// histories keep the last n samples of each key; transient-local topics hand theirs to late readers; a
/// writer reaches only readers that it has been matched with. Nothing moves but in advance_to(); wait()
/// returns at once. Not thread-safe.
class Network {
 public:
  explicit Network(const NetworkOptions& options);

  [[nodiscard]] std::int64_t now_ns() const;
  /// Delivers all that is due until then. Never goes back.
  void advance_to(std::int64_t now_ns);
  /// When something will happen by itself next.
  [[nodiscard]] std::optional<std::int64_t> next_event_ns() const;

  /// Ports may outlive the network. Destroying a port leaves the session at once, as a clean exit does.
  /// `delta_depth`: deltas kept by the server's writer, and by a client's reader. Errors: kInvalidArgument
  /// (name).
  [[nodiscard]] Result<std::unique_ptr<ServerPort>> make_server(const std::string& session,
                                                                std::uint32_t delta_depth = 64);
  [[nodiscard]] Result<std::unique_ptr<ClientPort>> make_client(const std::string& session,
                                                                std::uint32_t delta_depth = 64);

  /// From now on, in this direction.
  void set_link(const ParticipantId& from, const ParticipantId& to, const LinkModel& link);
  void set_all_links(const LinkModel& link);
  /// Cuts or mends both directions.
  void set_cut(const ParticipantId& a, const ParticipantId& b, bool cut);
  /// A frozen process neither receives nor repairs. Its port must not be called meanwhile.
  void set_frozen(const ParticipantId& participant, bool frozen);
  /// Gone without a word; others notice after the lease. Calls on its port have no effect any more.
  void kill(const ParticipantId& participant);

  [[nodiscard]] const NetworkCounts& counts() const;

 private:
  std::shared_ptr<Fabric> fabric_;
};

}  // namespace tandem::transport::simulated
