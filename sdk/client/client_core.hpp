#pragma once
// A client without a clock, a thread or a socket: join, reconstruct, re-simulate, rejoin, acknowledge, send
// input.

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
#include "sdk/transport/port.hpp"
#include "tandem/client_types.hpp"

namespace tandem::client {

/// Both clocks at one moment.
struct Now {
  std::int64_t steady_ns = 0;  ///< never goes back
  std::int64_t wall_ns = 0;    ///< comparable with the server's stamps when both run on one host
};

struct CoreOptions {
  std::string session;         ///< empty: whichever the port announces
  transport::ClientId id = 0;  ///< random, not 0; kept over rejoins and epochs
  transport::Role role = transport::Role::kParticipant;
  std::uint32_t lead = 1;
  std::string prefer;  ///< of streams: see read_preference()
  bool echo = false;   ///< samples show a gravity of this client's as soon as it is sent
  std::function<void(LogLevel, std::string_view)> log;  ///< may be empty
  /// For `frame_cost` only: a monotonic clock in nanoseconds. Null: not measured.
  std::int64_t (*measure_ns)() = nullptr;
};

/// Hears what a client takes in, in order. For hash logs, captures and tests; must not call the client.
class CoreListener {
 public:
  virtual ~CoreListener() = default;
  virtual void on_session(const transport::SessionMessage& /*session*/) {}
  /// One of the session's that was heard of last: it is joined, or, where the client plays already, its state
  /// of the frame applied last is held, and what follows is of this stream.
  virtual void on_stream(const transport::StreamMessage& /*stream*/) {}
  virtual void on_server_status(const transport::ServerStatusMessage& /*status*/) {}
  /// Loaded: the state of `snapshot.frame` is held.
  virtual void on_snapshot(const transport::SnapshotMessage& /*snapshot*/) {}
  /// New to this client, and in its timeline.
  virtual void on_scheduled(const transport::ScheduledInputMessage& /*input*/) {}
  /// Applied, and its hash was right.
  virtual void on_applied(Epoch /*epoch*/, const CompleteDelta& /*delta*/) {}
  virtual void on_outcome(const InputOutcome& /*outcome*/) {}
  virtual void on_resync(ResyncReason /*reason*/) {}
};

/// The rules of idl/STATES.md for one client. Every buffer is bounded. Not thread-safe, but for sample().
class ClientCore {
 public:
  /// A stream is left after so many joins in a row that each ended with a state other than the server's
  /// within so many frames: this client computes it otherwise, and would join for ever.
  static constexpr std::uint32_t kMostWrongJoins = 3;
  static constexpr std::uint64_t kSettledFrames = 30;

  /// `port` and `listener` (may be null) must outlive it.
  ClientCore(CoreOptions options, transport::ClientPort& port, CoreListener* listener = nullptr);
  ~ClientCore() = default;
  ClientCore(const ClientCore&) = delete;
  ClientCore& operator=(const ClientCore&) = delete;
  ClientCore(ClientCore&&) = delete;
  ClientCore& operator=(ClientCore&&) = delete;

  /// Takes what arrived and does what is due. Returns the steady time at which it wants to be called again
  /// even if nothing arrives.
  std::int64_t poll(Now now);

  /// Sends an input of the current epoch; returns its number.
  /// Errors: kOutOfOrder (not playing, or joined as an observer), kInvalidArgument (a value that is not
  /// finite, more than 16 values or 1,024 bytes), kTransport.
  Result<std::uint64_t> send(transport::InputKind kind, std::vector<double> values, transport::Bytes bytes,
                             Now now);

  /// Of streams, from the next poll() on: see CoreOptions::prefer.
  void prefer(std::string_view preference);

  [[nodiscard]] ClientPhase phase() const;
  [[nodiscard]] const Statistics& statistics() const { return statistics_; }
  /// Last announcement that was accepted or refused; null before the first.
  [[nodiscard]] const transport::SessionMessage* session() const;
  /// The one of its streams that is played or joined; null while there is none. Valid until the next poll().
  [[nodiscard]] const transport::StreamMessage* stream() const;
  /// The writer of the session's announcement lives, as the last poll() saw it.
  [[nodiscard]] bool server_alive() const { return server_alive_; }
  /// Null unless playing. Valid until the next poll().
  [[nodiscard]] const ClientTimeline* timeline() const;
  /// Wall clock of the server at a steady time of this client's, as far as known.
  [[nodiscard]] std::optional<std::int64_t> server_wall_ns(std::int64_t steady_ns) const;
  [[nodiscard]] ClientStatus status() const;
  [[nodiscard]] std::uint32_t join_attempt() const;
  /// The newest of this epoch; null before the first.
  [[nodiscard]] const transport::ReplyMessage* reply() const;

  /// Once before the first sample(): from now on each frame is made ready to be drawn.
  void start_sampling();
  /// While on, sample() shows the state of the moment it was switched on, or of a later snapshot, only
  /// predicted from there: see Uncorrected. What is agreed, acknowledged and hashed stays what it is.
  void show_uncorrected(bool on);
  /// Of what is shown, at the last frame applied; nothing while it is off or not playing.
  [[nodiscard]] std::optional<Drift> drift() const;
  /// The next three from any thread, at any time: they never wait for poll(). Nothing when there is nothing
  /// to draw.
  [[nodiscard]] std::optional<Drawable> drawable();
  /// The bodies at one moment, straight into the caller's memory. Allocates nothing unless the session
  /// changed. Errors: kOutOfOrder (nothing to draw), kCapacity (the columns are shorter than
  /// drawable().capacity, and are left as they are).
  Result<SampledFrame> sample(const SampleRequest& request, const SampleColumns& columns, Now now);
  /// See Client::sample().
  bool sample(Sample& out, SampleMode mode, Now now);

 private:
  /// What a poll takes from the port; kept to reuse its memory.
  struct Inbox {
    std::vector<transport::Received<transport::SessionMessage>> sessions;
    std::vector<transport::Received<transport::DeltaMessage>> deltas;
    std::vector<transport::Received<transport::ScheduledInputMessage>> inputs;
    std::vector<transport::Received<transport::SnapshotMessage>> snapshots;
    std::vector<transport::Received<transport::ReplyMessage>> replies;
    std::vector<transport::Received<transport::ServerStatusMessage>> statuses;
  };

  // client_core.cpp: sessions, acknowledgements, input, status
  void take_sessions(Now now);
  void adopt(const transport::Received<transport::SessionMessage>& announcement, Now now);
  void refuse(const Error& why);
  void take_replies(Now now);
  void report_outcomes();
  void echo(const transport::InputMessage& gravity, Now now);
  void show_clock();
  void send_ack(Now now);
  [[nodiscard]] std::int64_t next_ack_ns() const;
  void send_status(Now now);
  [[nodiscard]] std::int64_t next_due_ns(Now now) const;

  // client_stream.cpp: take in, play
  void take_stream(Now now);
  /// Null, and counted, where it is none that is followed.
  [[nodiscard]] Follower* followed(const StreamId& stream);
  void take_deltas(Now now);
  void take_scheduled();
  void take_snapshots(Now now);
  void play(Now now, std::int64_t since_last_poll_ns);
  void on_applied(const CompleteDelta& delta, std::int64_t cost_ns, Now now);
  void simulate_ahead(Now now);
  void play_ahead(Now now);
  void prepare_next();

  // client_join.cpp: join, join again
  /// Returns the snapshot once it is loaded.
  [[nodiscard]] std::optional<transport::SnapshotMessage> join(Follower& to, Now now);
  void begin(Now now);
  void follow_uncorrected();
  void count(const Follower::Loss& loss);
  /// By the stream that is played or joined.
  void on_loss(const Follower::Loss& loss, Now now);

  // client_change.cpp: choose, change
  [[nodiscard]] Result<std::unique_ptr<Follower>> choose_stream(const transport::SessionMessage& session,
                                                                Now now);
  [[nodiscard]] Result<std::unique_ptr<Follower>> follow(const transport::SessionMessage& session,
                                                         Now now) const;
  void leave_unplayable(Now now);
  void tell_stream();
  void consider_streams(Now now);
  void change_stream(Now now);
  /// In the place of the one that is played or joined.
  void join_instead(std::unique_ptr<Follower> other, Now now);
  void follow_change(Now now);
  /// By the stream that is on its way.
  void on_loss_in_change(const Follower::Loss& loss, Now now);
  void move_over(Now now);
  void show_other(Frame left_at, Now now);
  void give_up_change(const std::string& why, Now now);
  void adopt_streams(const transport::SessionMessage& session, Now now);

  /// Counts what is not of this epoch and this server.
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
    epoch_->silence_ns = 0;
    return true;
  }
  [[nodiscard]] std::int64_t measure() const {
    return options_.measure_ns != nullptr ? options_.measure_ns() : 0;
  }
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
  std::vector<InputOutcome> outcomes_;  ///< not yet told to the listener
  Inbox inbox_;

  PictureExchange pictures_;
  Sampler sampler_;  ///< in turns: while reading a picture
  bool shows_uncorrected_ = false;

  std::optional<transport::SessionMessage> session_;  ///< last announcement, playable or not
  transport::ParticipantId session_from_;
  std::string refusal_;                   ///< why it is not
  std::unique_ptr<EpochState> epoch_;     ///< null while there is no playable session
  std::optional<StreamChooser> chooser_;  ///< of that session
  std::optional<double> own_step_ns_;     ///< once it was measured
  std::uint32_t join_attempts_ = 0;       ///< of the epochs before it

  bool server_alive_ = false;
  bool ack_due_ = false;
  std::int64_t last_ack_ns_ = 0;
  Frame acknowledged_ = 0;  ///< `applied` of the last acknowledgement
  std::int64_t last_poll_ns_ = 0;
  std::int64_t poll_began_ns_ = 0;  ///< by options_.measure_ns
};

}  // namespace tandem::client
