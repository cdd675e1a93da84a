#pragma once
// Serves a session to viewers that have no DDS.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdk/client/following/delta_assembly.hpp"
#include "sdk/client/session/sent_inputs.hpp"
#include "sdk/wire/frame_bundle.hpp"
#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"
#include "services/follow/following/input_merger.hpp"
#include "services/follow/following/session_sink.hpp"
#include "services/follow/following/world.hpp"
#include "services/gateway/counts.hpp"
#include "services/gateway/viewing/grouping.hpp"
#include "services/gateway/viewing/live_log.hpp"
#include "services/gateway/viewing/outgoing.hpp"
#include "services/gateway/viewing/viewer.hpp"

namespace tandem::gateway {

/// Maximum size of a viewer's message.
inline constexpr std::size_t kMaxViewerBytes = 2048;

struct Limits {
  std::size_t viewers = 256;
  std::size_t queue_bytes = 4U << 20U;  ///< of deltas and scheduled inputs, held once for all viewers
};

/// The rules of idl/STATES.md, "The gateway", for all viewers, without a clock, a thread or a socket. It is
/// to a viewer what the server is to a client. Every buffer is bounded. Not thread-safe.
class Gateway final : public following::SessionSink {
 public:
  /// A viewer that is this far behind gets a snapshot if that is smaller than what is queued for it.
  static constexpr std::int64_t kBehindNs = kSecond;
  /// A viewer that reads nothing for this time is disconnected.
  static constexpr std::int64_t kNotReadingNs = 30 * kSecond;
  /// A viewer that was told of a session and acknowledges nothing for this time is disconnected.
  static constexpr std::int64_t kSilentNs = 10 * kSecond;
  /// Maximum number of a viewer's inputs without an outcome, which is as many as a reply can list.
  static constexpr std::size_t kMaxUndecided = transport::kReplyRing;

  /// `world` must outlive it.
  Gateway(const Limits& limits, following::FollowedWorld& world);

  // What viewers do.
  /// Adds a connection; returns nothing if there are too many. `inputs` limits the inputs of all viewers that
  /// share it. A viewer that may not act is an observer.
  [[nodiscard]] std::optional<ViewerId> admit(std::shared_ptr<accounts::TokenBucket> inputs = nullptr,
                                              bool may_act = true);
  void leave(ViewerId id);
  /// Takes one message. Untrusted. Returns why the connection has to end, if it has to.
  [[nodiscard]] std::optional<Refusal> receive(ViewerId id, std::span<const std::byte> message,
                                               std::int64_t now_ns);
  struct Next {
    OutgoingPtr message;  ///< null: nothing to send
    bool more = false;    ///< there is another behind it
  };
  /// The next message to send to a viewer that can take one.
  [[nodiscard]] Next next(ViewerId id, std::int64_t now_ns);
  /// Lists the viewers for which next() has something. Replaces `out`.
  void list_ready(std::int64_t now_ns, std::vector<ViewerId>& out);
  /// Whether there is a viewer for which next() has something.
  [[nodiscard]] bool any_ready(std::int64_t now_ns);
  /// Lists the viewers that have to be disconnected because they read nothing. Replaces `out`.
  void list_not_reading(std::int64_t now_ns, std::vector<ViewerId>& out) const;
  /// Lists the viewers that have to be disconnected because they acknowledge nothing. Replaces `out`.
  void list_silent(std::int64_t now_ns, std::vector<ViewerId>& out);

  /// Lists the viewers that have to be disconnected because their connection took more than their cap, with
  /// both numbers for a human. Replaces `out`.
  void list_over_cap(std::int64_t now_ns, std::vector<std::pair<ViewerId, std::string>>& out);

  /// What a viewer's inputs became since the last call; empty without such a viewer.
  [[nodiscard]] InputTally take_tally(ViewerId id);

  // What happens in the session. With another epoch, all that belongs to the last one is dropped, but for
  // inputs and their outcomes where the two share a history.
  void on_session(const transport::SessionMessage& session) override;
  /// Viewers are told of it all the same, and say themselves why they cannot play it.
  void on_unplayed(const transport::SessionMessage& session) override { on_session(session); }
  void on_scheduled(const transport::ScheduledInputMessage& input, std::int64_t now_ns) override;
  void on_applied(const client::CompleteDelta& delta, std::int64_t now_ns) override;
  void on_happened(const client::Happened& event, std::int64_t now_ns) override;
  void on_outcome(const client::InputOutcome& outcome, std::int64_t now_ns) override;
  void on_status(const transport::ServerStatusMessage& status, std::int64_t now_ns) override;
  void on_server_alive(bool alive) override;
  void on_names(const transport::SessionMessage& session) override;

  /// Does what is due. Returns when it wants to be called again; INT64_MAX means when something happens.
  std::int64_t poll(std::int64_t now_ns);

  [[nodiscard]] const Counts& counts() const { return counts_; }
  [[nodiscard]] Counts& counts() { return counts_; }
  [[nodiscard]] std::size_t viewers() const { return viewers_.size(); }
  [[nodiscard]] Frame frame() const { return frame_; }
  /// True if there is a session and its server is alive.
  [[nodiscard]] bool server_alive() const { return alive_; }
  [[nodiscard]] const std::optional<transport::SessionMessage>& session() const { return session_; }

 private:
  // gateway.cpp: announcements, what is sent next, snapshots
  [[nodiscard]] bool reply_due(Viewer& viewer, std::int64_t now_ns) const;
  /// Up to where the log may leave towards a viewer.
  [[nodiscard]] LiveLog::Place until(const Viewer& viewer) const;
  [[nodiscard]] bool is_behind(const Viewer& viewer, std::int64_t now_ns) const;
  [[nodiscard]] bool ready(Viewer& viewer, std::int64_t now_ns) const;
  [[nodiscard]] bool status_due(const Viewer& viewer, std::int64_t now_ns) const;
  [[nodiscard]] OutgoingPtr take_next(Viewer& viewer, std::int64_t now_ns);
  [[nodiscard]] OutgoingPtr reply(Viewer& viewer, std::int64_t now_ns) const;
  void skip(Viewer& viewer);
  /// Lets a viewer that holds a frame go on from there, once the gateway is as far.
  void resume(Viewer& viewer);
  void announce(OutgoingPtr announcement);
  /// What deltas to a viewer take on the network, bytes a second.
  [[nodiscard]] double deltas_bytes_per_s(std::int64_t now_ns);
  [[nodiscard]] std::optional<std::int64_t> cut_due_ns() const;
  void cut(std::int64_t now_ns);

  // viewers.cpp: what viewers say
  [[nodiscard]] std::optional<Refusal> take(Viewer& viewer, transport::ViewerMessage&& message,
                                            std::int64_t now_ns);
  [[nodiscard]] std::optional<Refusal> take(Viewer& viewer, const transport::AckMessage& ack,
                                            std::int64_t now_ns);
  void take(Viewer& viewer, transport::InputMessage&& input, std::int64_t now_ns);
  void report(Viewer& viewer, transport::ClientStatusMessage&& status, std::int64_t now_ns);
  void on_joining(Viewer& viewer, const transport::AckMessage& ack, std::int64_t now_ns);
  [[nodiscard]] transport::Reason check(Viewer& viewer, const transport::InputMessage& input,
                                        std::int64_t now_ns) const;
  [[nodiscard]] transport::Role role_of(const Viewer& viewer) const;
  void tell(std::vector<accounts::InputVerdict>& verdicts, std::int64_t now_ns);
  void refuse_input(Viewer& viewer, const accounts::InputVerdict& verdict, std::int64_t now_ns);

  Limits limits_;
  following::FollowedWorld& world_;
  Counts counts_;
  std::map<ViewerId, Viewer> viewers_;
  ViewerId last_id_ = 0;

  std::optional<transport::SessionMessage> session_;
  bool alive_ = false;
  OutgoingPtr announcement_;  // the session, or that it is absent
  std::uint64_t announcement_number_ = 0;
  OutgoingPtr status_;  // the server's newest
  std::uint64_t status_number_ = 0;
  std::int64_t status_ns_ = 0;  // when it came

  LiveLog log_;
  Grouping grouping_;
  std::optional<LiveLog::Place> newest_delta_;
  RecentBytes deltas_;             // on the network
  Frame frame_ = 0;                // the newest that a viewer may hold
  transport::FrameBundle bundle_;  // the frames of the message that is being applied
  /// Scheduled inputs whose number no applied delta has named yet.
  struct ComingInput {
    std::uint64_t number = 0;
    OutgoingPtr message;
  };
  std::deque<ComingInput> coming_inputs_;
  static constexpr std::size_t kMaxComingInputs = 4096;

  std::optional<std::int64_t> collecting_since_ns_;  // joiners of the next snapshot
  std::optional<std::int64_t> cut_at_ns_;
  std::int64_t hurried_ns_ = INT64_MIN / 2;  // for an event
  std::size_t snapshot_bytes_ = 0;           // of the last one

  following::InputMerger merger_;
  std::vector<accounts::InputVerdict> verdicts_;  // kept to reuse its memory
  bool settling_ = false;  // outcomes of an earlier epoch's inputs are awaited, before viewers get a reply
  transport::Role granted_ = transport::Role::kObserver;  // to the gateway, by the last reply
};

}  // namespace tandem::gateway
