#pragma once
// A publish-subscribe network in memory, with a manual clock and seeded delay, loss and matching.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "sdk/transport/simulated/bottleneck.hpp"
#include "sdk/wire/port.hpp"

namespace tandem::transport::simulated {

/// Time from when a reader could see a gap until it asks: the delay of a NACK, and half a heartbeat's period.
inline constexpr std::int64_t kNackNs = 20'000'000;

/// How samples travel from one participant to another.
struct LinkModel {
  std::int64_t delay_ns = 1'000'000;
  std::int64_t jitter_ns = 0;  ///< added uniformly; the order within a topic and writer is kept nevertheless
  double loss = 0;             ///< chance that one transmission is lost, first or repeated
  /// A lost sample of a reliable topic is sent again after this time, if it is still kept. Empty: the reader
  /// asks kNackNs after a later sample could have shown the gap, and both ways take as long as their links.
  std::optional<std::int64_t> repair_ns = {};
  /// Chance that a lost sample of a reliable topic is never repaired. Announcements always are, in the end:
  /// nobody writes them again, and their writer keeps them.
  double lost_for_good = 0;
  /// A bottleneck that all samples pass, also those of other paths that name the same one; samples that it
  /// drops are lost. Null: no bottleneck.
  std::shared_ptr<Bottleneck> bottleneck = nullptr;
  /// Additional share of transmissions that are lost in bursts, less than 1, and the mean length of a burst,
  /// at least 1. Bursts do not end by themselves while nothing is sent.
  double burst_loss = 0, burst_samples = 1;
  /// Chance that a transmission comes twice. DDS delivers it once, but the bottleneck has to take both.
  double duplicates = 0;
  /// Chances that a delta or a part of a snapshot arrives with one bit flipped, or cut short.
  double flipped = 0, truncated = 0;
};

struct NetworkOptions {
  std::uint64_t seed = 1;
  LinkModel link;  ///< for all links without their own
  /// A writer and a reader find each other after a time in this range, drawn for each pair.
  std::int64_t match_min_ns = 1'000'000, match_max_ns = 20'000'000;
  /// Adds what the links take: one way for the news of an endpoint, a round trip before that for two
  /// participants that never met, and the repair of lost messages.
  bool match_over_links = false;
  /// A frozen, killed or cut-off peer counts as dead after this.
  std::int64_t lease_ns = 1'000'000'000;
  /// Parts of snapshots and checkpoints that are older are not repaired; with DDS it is 0.3 s.
  std::int64_t part_lifespan_ns = INT64_MAX;
};

/// Counts of what happened to samples on the way, by which tests check that they tested anything.
struct NetworkCounts {
  std::uint64_t delivered = 0;
  std::uint64_t repaired = 0;
  std::uint64_t duplicated = 0;
  std::uint64_t overtaken = 0;    ///< samples of a best-effort topic that were dropped because a newer one
                                  ///< was delivered
  std::uint64_t overwritten = 0;  ///< samples that left the writer's history before their repair, or were
                                  ///< too old for it
  std::uint64_t lost_for_good = 0;
  std::uint64_t pushed_out = 0;  ///< samples displaced at a reader that did not take them in time
  std::uint64_t damaged = 0;
};

/// Sends commands to servers, as an operator's tool does. They are lost before the two have found each other.
class CommandPort {
 public:
  virtual ~CommandPort() = default;
  virtual Result<void> write(const CommandMessage&) = 0;
};

class Fabric;

/// Makes ports and moves the clock. The same calls with the same seed give the same deliveries.
///
/// The rules are those of DDS as the ports in dds/ use it:
/// - Order is kept within a topic and writer, and nowhere else.
/// - A lost sample holds up later ones of its topic and writer until it is repaired or gone.
/// - On a best-effort topic, samples that were overtaken are dropped.
/// - Histories keep the last n samples of each key.
/// - Transient-local topics hand their history to late readers.
/// - A writer reaches only readers that it is matched with. Time moves only in advance_to(); wait() returns
/// at once. Not thread-safe.
class Network {
 public:
  explicit Network(const NetworkOptions& options);

  [[nodiscard]] std::int64_t now_ns() const;
  /// Delivers everything that is due until `now_ns`, which never goes back.
  void advance_to(std::int64_t now_ns);
  /// When the next event will happen by itself.
  [[nodiscard]] std::optional<std::int64_t> next_event_ns() const;

  /// Makes a port, which may outlive the network. Destroying a port leaves the session at once, as a clean
  /// exit does. `delta_depth`: deltas kept by the server's writer, and by a client's reader. Errors:
  /// kInvalidArgument (name).
  [[nodiscard]] Result<std::unique_ptr<ServerPort>> make_server(const std::string& session,
                                                                std::uint32_t delta_depth = 64);
  [[nodiscard]] Result<std::unique_ptr<ClientPort>> make_client(const std::string& session,
                                                                std::uint32_t delta_depth = 64);

  [[nodiscard]] Result<std::unique_ptr<CommandPort>> make_commander(const std::string& session);

  /// Changes the link in this direction from now on.
  void set_link(const ParticipantId& from, const ParticipantId& to, const LinkModel& link);
  void set_all_links(const LinkModel& link);
  /// Cuts or restores both directions.
  void set_cut(const ParticipantId& a, const ParticipantId& b, bool cut);
  /// Cuts or restores one direction. What is lost there is not repaired, and nobody finds the other anew, as
  /// long as either direction is cut.
  void set_cut_one_way(const ParticipantId& from, const ParticipantId& to, bool cut);
  /// A frozen process neither receives nor repairs. Its port must not be called meanwhile.
  void set_frozen(const ParticipantId& participant, bool frozen);
  /// Kills a participant without notice; others notice after the lease. Calls on its port have no effect any
  /// more.
  void kill(const ParticipantId& participant);

  [[nodiscard]] const NetworkCounts& counts() const;
  /// Samples that a participant was delivered so far: it has something to take when this has grown.
  [[nodiscard]] std::uint64_t delivered_to(const ParticipantId& participant) const;

 private:
  std::shared_ptr<Fabric> fabric_;
};

}  // namespace tandem::transport::simulated
