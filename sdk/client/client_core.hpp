#pragma once
// The client without a clock, a thread or a socket: it joins, reconstructs, re-simulates, rejoins,
// acknowledges and sends input.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/client/core_options.hpp"
#include "sdk/client/drawing/sampler.hpp"
#include "sdk/client/followed_epoch.hpp"
#include "sdk/client/lasting.hpp"
#include "sdk/client/session/status_report.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/port.hpp"
#include "tandem/client_types.hpp"

namespace tandem::client {

/// Implements the rules of idl/STATES.md for one client. Every buffer is bounded. Not thread-safe, except
/// sample().
class ClientCore {
 public:
  /// `port` and `listener` must outlive the core; `listener` may be null.
  ClientCore(CoreOptions options, transport::ClientPort& port, CoreListener* listener = nullptr);
  ~ClientCore() = default;
  ClientCore(const ClientCore&) = delete;
  ClientCore& operator=(const ClientCore&) = delete;

  /// Takes what arrived and does what is due. Returns the steady time at which it must be called again even
  /// if nothing arrives.
  std::int64_t poll(Now now);

  /// Simulates the frame after the last one applied, which poll() leaves to the caller without
  /// CoreOptions::prepares: what poll() told of can be passed on first. Call it after each poll().
  void prepare() {
    if (epoch_) epoch_->prepare();
  }

  /// Sends an input in the current epoch and returns its number. Errors: kOutOfOrder (not playing, or joined
  /// as an observer), kInvalidArgument (a value that is not finite, more than 16 values or 1,024 bytes),
  /// kTransport.
  Result<std::uint64_t> send(transport::InputKind kind, std::vector<double> values, transport::Bytes bytes,
                             Now now);

  /// Changes CoreOptions::prefer, from the next poll() on.
  void prefer(std::string_view preference);
  /// Changes CoreOptions::keeps_state, from the next poll() on. Without a state, deltas are told to the
  /// listener in order, with the scheduled inputs that they count, and are not read: nobody checked their
  /// hash. For a relay whose followers all check it. To have a state again, a client fetches a snapshot while
  /// it goes on.
  void keep_state(bool on) { lasting_.options.keeps_state = on; }
  /// True while it plays and timeline() has the state of the frame that was told last.
  [[nodiscard]] bool holds_state() const;

  [[nodiscard]] ClientPhase phase() const;
  [[nodiscard]] const Statistics& statistics() const { return lasting_.statistics; }
  /// The last announcement that was accepted or refused; null before the first.
  [[nodiscard]] const transport::SessionMessage* session() const;
  /// The stream that is played or joined; null while there is none. Valid until the next poll().
  [[nodiscard]] const transport::StreamMessage* stream() const;
  /// True if the writer of the session's announcement was alive at the last poll().
  [[nodiscard]] bool server_alive() const { return lasting_.server_alive; }
  /// Null unless playing. Valid until the next poll().
  [[nodiscard]] const ClientTimeline* timeline() const;
  /// The server's wall clock at a steady time of this client; empty while unknown.
  [[nodiscard]] std::optional<std::int64_t> server_wall_ns(std::int64_t steady_ns) const;
  [[nodiscard]] ClientStatus status() const;
  /// Whether the server said within the last three seconds that it makes frames; empty if it said nothing.
  [[nodiscard]] std::optional<bool> server_makes_frames(std::int64_t now_ns) const;
  /// Whether frames should come: it makes them, and no snapshot is on its way.
  [[nodiscard]] bool frames_are_due(std::int64_t now_ns) const;
  [[nodiscard]] std::uint32_t join_attempt() const;
  /// The name of the body that is in a slot now; empty if it has none or the client does not play.
  [[nodiscard]] std::string_view body_name(Slot slot) const;
  /// The keys of the session at the last frame that was told: see CoreListener::on_key(). Valid until the
  /// next poll().
  [[nodiscard]] const SessionWorld::Keys& keys() const { return lasting_.news.keys(); }
  /// True if the outcome of every input of earlier epochs is known.
  [[nodiscard]] bool inputs_settled() const { return lasting_.sent.settled(); }
  /// The newest reply of this epoch; null before the first.
  [[nodiscard]] const transport::ReplyMessage* reply() const;

  /// Call once before the first sample(): from now on each frame is prepared for drawing.
  void start_sampling();
  /// While this is on, sample() shows the state of the moment it was switched on, or of a later snapshot,
  /// only predicted from there: see Uncorrected. The agreed state, its acknowledgements and its hash stay the
  /// same.
  void show_uncorrected(bool on);
  /// The drift of the shown state at the last frame applied; empty while this is off or the client does not
  /// play.
  [[nodiscard]] std::optional<Drift> drift() const;
  /// The next three functions may be called from any thread at any time. They never wait for poll(). The
  /// result is empty or an error if there is nothing to draw.
  [[nodiscard]] std::optional<Drawable> drawable();
  /// Writes the bodies at one moment straight into the caller's memory. Allocates nothing unless the session
  /// changed. Errors: kOutOfOrder (nothing to draw), kCapacity (the columns are shorter than
  /// drawable().capacity and are not written).
  Result<SampledFrame> sample(const SampleRequest& request, const SampleColumns& columns, Now now);
  /// See Client::sample().
  bool sample(Sample& out, SampleMode mode, Now now);

 private:
  void tell_trouble();
  void begin_under(transport::ClientId id);
  void take_sessions(Now now);
  void take(transport::Received<transport::SessionMessage>& announcement, Now now);
  void adopt(const transport::Received<transport::SessionMessage>& announcement, Now now);
  [[nodiscard]] bool may_go_on_with(const transport::SessionMessage& announced) const;
  void go_on_with(transport::Received<transport::SessionMessage>& announcement, Now now);
  void note_imitator();
  void adopt_names(std::vector<transport::BodyName> names);
  void end_epoch();
  void refuse(const Error& why);
  void report_outcomes();
  void send_status(Now now);
  [[nodiscard]] std::int64_t next_due_ns(Now now) const;

  CoreListener silent_;
  Lasting lasting_;
  StatusReport status_report_;
  Sampler sampler_;  ///< used only while a picture is being read, so by one thread at a time

  std::vector<transport::Received<transport::SessionMessage>> announcements_;  ///< kept to reuse the memory
  std::optional<transport::SessionMessage> session_;  ///< last announcement, playable or not
  transport::ParticipantId session_from_;
  Epoch imitated_ = 0;                    ///< the last epoch that somebody else announced, too
  std::string refusal_;                   ///< why the session is not playable
  std::string trouble_;                   ///< the port's, as it was told last
  std::unique_ptr<FollowedEpoch> epoch_;  ///< null while there is no playable session
  std::int64_t last_poll_ns_ = 0;
};

}  // namespace tandem::client
