#pragma once
// The client without a clock, a thread or a socket: it joins, reconstructs, re-simulates, rejoins,
// acknowledges and sends input.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/client/drawing/picture.hpp"
#include "sdk/client/drawing/sampler.hpp"
#include "sdk/client/epoch_state.hpp"
#include "sdk/client/following/delta_assembly.hpp"
#include "sdk/client/session/sent_inputs.hpp"
#include "sdk/client/session/statistics.hpp"
#include "sdk/client/session/status_report.hpp"
#include "sdk/client/session/stream_choice.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/port.hpp"
#include "tandem/client_types.hpp"

namespace tandem::client {

/// Both clocks at one moment.
struct Now {
  std::int64_t steady_ns = 0;  ///< never goes back
  std::int64_t wall_ns = 0;    ///< comparable with the server's stamps when both run on one host
};

struct CoreOptions {
  std::string session;         ///< empty: the session that the port announces
  transport::ClientId id = 0;  ///< random, not 0; kept over rejoins and epochs
  transport::Role role = transport::Role::kParticipant;
  std::uint32_t lead = 1;
  std::string prefer;  ///< preferred stream: see read_preference()
  bool echo = false;   ///< samples show a gravity that this client sent at once
  /// Threads for states and samples of many bodies; may be called by the poll and by sample() at the same
  /// time. Empty: none.
  RunBlocks run_blocks = {};
  bool keeps_state = true;                              ///< see ClientCore::keep_state()
  bool prepares = true;                                 ///< false: see ClientCore::prepare()
  std::function<void(LogLevel, std::string_view)> log;  ///< may be empty
  /// For `frame_cost` only: a monotonic clock in nanoseconds. Null: not measured.
  std::int64_t (*measure_ns)() = nullptr;
};

/// Is told in order what a client takes in. For hash logs, captures and tests. It must not call the client.
class CoreListener {
 public:
  virtual ~CoreListener() = default;
  virtual void on_session(const transport::SessionMessage& /*session*/) {}
  /// The session in the last on_session() gives its bodies other names; nothing else of it changed.
  virtual void on_names(const transport::SessionMessage& /*session*/) {}
  /// A stream of the session in the last on_session(). The client joins it. If the client already plays, it
  /// now has this stream's state, and the following calls are for this stream. timeline() says of which
  /// frame: of the one applied last, or, where more than a second of deltas waited, of a later one.
  virtual void on_stream(const transport::StreamMessage& /*stream*/) {}
  virtual void on_server_status(const transport::ServerStatusMessage& /*status*/) {}
  /// A snapshot was loaded: the client holds the state of `snapshot.frame`.
  virtual void on_snapshot(const transport::SnapshotMessage& /*snapshot*/) {}
  /// A scheduled input that is new to this client and in its timeline.
  virtual void on_scheduled(const transport::ScheduledInputMessage& /*input*/) {}
  /// A delta was applied and its hash was right; without a state (ClientCore::keep_state()) it is next.
  virtual void on_applied(Epoch /*epoch*/, const CompleteDelta& /*delta*/) {}
  virtual void on_outcome(const InputOutcome& /*outcome*/) {}
  virtual void on_resync(ResyncReason /*reason*/) {}
};

/// Implements the rules of idl/STATES.md for one client. Every buffer is bounded. Not thread-safe, except
/// sample().
class ClientCore {
 public:
  /// A stream is left after so many joins in a row that each ended with a state other than the server's
  /// within so many frames: this client computes it otherwise, and would join for ever.
  static constexpr std::uint32_t kMostWrongJoins = 3;
  static constexpr std::uint64_t kSettledFrames = 30;

  /// `port` and `listener` must outlive the core; `listener` may be null.
  ClientCore(CoreOptions options, transport::ClientPort& port, CoreListener* listener = nullptr);
  ~ClientCore() = default;
  ClientCore(const ClientCore&) = delete;
  ClientCore& operator=(const ClientCore&) = delete;
  ClientCore(ClientCore&&) = delete;
  ClientCore& operator=(ClientCore&&) = delete;

  /// Takes what arrived and does what is due. Returns the steady time at which it must be called again even
  /// if nothing arrives.
  std::int64_t poll(Now now);

  /// Simulates the frame after the last one applied, which poll() leaves to the caller without
  /// CoreOptions::prepares: what poll() told of can be passed on first. Call it after each poll().
  void prepare() {
    if (epoch_) prepare_next();
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
  void keep_state(bool on) { options_.keeps_state = on; }
  /// True while it plays and timeline() has the state of the frame that was told last.
  [[nodiscard]] bool holds_state() const;

  [[nodiscard]] ClientPhase phase() const;
  [[nodiscard]] const Statistics& statistics() const { return statistics_; }
  /// The last announcement that was accepted or refused; null before the first.
  [[nodiscard]] const transport::SessionMessage* session() const;
  /// The stream that is played or joined; null while there is none. Valid until the next poll().
  [[nodiscard]] const transport::StreamMessage* stream() const;
  /// True if the writer of the session's announcement was alive at the last poll().
  [[nodiscard]] bool server_alive() const { return server_alive_; }
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
  /// True if the outcome of every input of earlier epochs is known.
  [[nodiscard]] bool inputs_settled() const { return sent_.settled(); }
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
  /// The messages that a poll takes from the port; kept to reuse the memory.
  struct Inbox {
    std::vector<transport::Received<transport::SessionMessage>> sessions;
    std::vector<transport::Received<transport::DeltaMessage>> deltas;
    std::vector<transport::Received<transport::ScheduledInputMessage>> inputs;
    std::vector<transport::Received<transport::SnapshotMessage>> snapshots;
    std::vector<transport::Received<transport::ReplyMessage>> replies;
    std::vector<transport::Received<transport::ServerStatusMessage>> statuses;
  };

  // client_core.cpp: sessions, acknowledgements, input, status
  void leave_silent(std::int64_t since_ns);
  void tell_trouble();
  void begin_under(transport::ClientId id);
  void take_sessions(Now now);
  void adopt(const transport::Received<transport::SessionMessage>& announcement, Now now);
  [[nodiscard]] bool may_go_on_with(const transport::SessionMessage& announced) const;
  void go_on_with(transport::Received<transport::SessionMessage>& announcement, Now now);
  void note_imitator();
  void adopt_names(std::vector<transport::BodyName> names);
  void refuse(const Error& why);
  void take_replies(Now now);
  void report_outcomes();
  void echo(const transport::InputMessage& gravity, Now now);
  void show_clock();
  void send_ack(Now now);
  [[nodiscard]] std::int64_t next_ack_ns() const;
  void send_status(Now now);
  [[nodiscard]] std::int64_t next_due_ns(Now now) const;

  // client_stream.cpp: take messages, play
  void take_stream(Now now);
  /// The follower of a stream. If the stream is not followed, returns null and counts the message.
  [[nodiscard]] Follower* followed(const StreamId& stream);
  void take_deltas(Now now);
  void take_delta(transport::DeltaMessage&& delta, Now now);
  void take_scheduled();
  void take_scheduled(const transport::ScheduledInputMessage& message);
  void take_early(Now now);
  void take_snapshots(Now now);
  void play(Now now, std::int64_t since_last_poll_ns);
  void on_applied(const CompleteDelta& delta, std::int64_t cost_ns, Now now);
  void simulate_ahead(Now now);
  void play_ahead(Now now);
  void prepare_next();

  // client_join.cpp: join and rejoin
  /// Returns the snapshot once it is loaded.
  [[nodiscard]] std::optional<transport::SnapshotMessage> join(Follower& to, Now now);
  void begin(Now now);
  void fetch_state(Now now);
  void follow_uncorrected();
  void count(const Follower::Loss& loss);
  /// Handles a loss of the stream that is played or joined.
  void on_loss(const Follower::Loss& loss, Now now);

  // client_change.cpp: choose, change
  [[nodiscard]] Result<std::unique_ptr<Follower>> choose_stream(const transport::SessionMessage& session,
                                                                Now now);
  [[nodiscard]] Result<std::unique_ptr<Follower>> follow(const transport::SessionMessage& session,
                                                         Now now) const;
  void leave_unplayable(Now now);
  /// Makes the first choice, once enough is known or was waited for. False: not yet.
  [[nodiscard]] bool settle_choice(Now now);
  void tell_stream();
  void take_statuses(Now now);
  void tell_if_only_measured(const transport::ServerStatusMessage& status);
  void consider_streams(Now now);
  void change_stream(Now now);
  /// Joins `other` instead of the stream that is played or joined.
  void join_instead(std::unique_ptr<Follower> other, Now now);
  void follow_change(Now now);
  /// Handles a loss of the stream that the client is changing to.
  void on_loss_in_change(const Follower::Loss& loss, Now now);
  void move_over(Now now);
  void show_other(Frame left_at, Now now);
  void give_up_change(const std::string& why, Now now);
  void adopt_streams(const transport::SessionMessage& session, Now now);

  /// True if a message is of this epoch and not of this server, and was kept.
  template <class M>
  [[nodiscard]] bool is_early(transport::Received<M>& received) {
    if (received.from == epoch_->server || received.message.epoch != epoch_->session.epoch ||
        epoch_->played->joining() || !port_.hears_all_servers())
      return false;
    ++statistics_.foreign_messages;
    epoch_->early.add(std::move(received));
    return true;
  }
  /// True if a message is of this epoch and this server; others are counted.
  template <class M>
  [[nodiscard]] bool belongs(const transport::Received<M>& received) {
    if (received.from != epoch_->server) {
      ++statistics_.foreign_messages;
      return false;
    }
    if (received.message.epoch != epoch_->session.epoch) {
      ++statistics_.stale_messages;
      return false;
    }
    epoch_->silence_ns = epoch_->quiet_ns = 0;
    epoch_->unproven = false;
    return true;
  }
  [[nodiscard]] std::int64_t measure() const {
    return options_.measure_ns != nullptr ? options_.measure_ns() : 0;
  }
  /// A poll that has worked for so long begins no further step, so that a stream whose steps take long
  /// freezes nobody. Without a clock it never has.
  static constexpr std::int64_t kMostPollNs = 50'000'000;
  [[nodiscard]] bool is_spent() const { return measure() - poll_began_ns_ >= kMostPollNs; }
  void log(LogLevel level, std::string_view line) const {
    if (options_.log) options_.log(level, line);
  }

  CoreOptions options_;
  StreamPreference preference_;
  transport::ClientPort& port_;
  CoreListener silent_;
  CoreListener& listener_;
  Statistics statistics_;
  StatusReport status_report_;
  SentInputs sent_;
  std::vector<InputOutcome> outcomes_;  ///< outcomes that the listener was not told yet
  Inbox inbox_;

  PictureExchange pictures_;
  Sampler sampler_;  ///< used only while a picture is being read, so by one thread at a time
  bool shows_uncorrected_ = false;

  std::optional<transport::SessionMessage> session_;  ///< last announcement, playable or not
  transport::ParticipantId session_from_;
  Epoch imitated_ = 0;                    ///< the last epoch that somebody else announced, too
  std::string refusal_;                   ///< why the session is not playable
  std::string trouble_;                   ///< the port's, as it was told last
  std::unique_ptr<EpochState> epoch_;     ///< null while there is no playable session
  std::optional<StreamChooser> chooser_;  ///< chooses among the streams of that session
  std::int64_t choice_due_ns_ = 0;        ///< until when its first choice waits for statuses; 0: it was made
  std::optional<double> own_step_ns_;     ///< empty until it was measured
  std::uint32_t join_attempts_ = 0;       ///< join attempts of earlier epochs

  bool told_measured_ = false;  ///< that the stream which was asked for is not offered
  bool server_alive_ = false;
  bool ack_due_ = false;
  std::int64_t last_ack_ns_ = 0;
  Frame acknowledged_ = 0;  ///< `applied` of the last acknowledgement
  std::int64_t last_poll_ns_ = 0;
  std::int64_t told_ns_ = INT64_MIN / 2;  ///< when the server's last status came
  bool makes_frames_ = false;             ///< as it said
  std::int64_t part_ns_ = INT64_MIN / 2;  ///< when the last part of a snapshot came
  std::int64_t poll_began_ns_ = 0;        ///< by options_.measure_ns
};

}  // namespace tandem::client
