#pragma once
// The session that a relay passes on: one client of it for each stream that somebody wants.

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/client/following/delta_assembly.hpp"
#include "sdk/wire/port.hpp"
#include "services/follow/following/input_merger.hpp"
#include "services/follow/following/session_client.hpp"
#include "services/follow/following/session_sink.hpp"
#include "services/host/frames/frame_source.hpp"

namespace tandem::relay {

/// One stream, followed as a client does. While it keeps a state, every delta in its queue was applied and
/// had the server's hash. Not thread-safe.
class Feed final : public following::SessionSink {
 public:
  static constexpr std::size_t kMaxQueuedBytes = 64U << 20U;
  static constexpr std::size_t kMaxQueued = 1U << 14U;

  Feed(std::uint32_t stream, client::CoreOptions options, std::unique_ptr<transport::ClientPort> port);

  std::int64_t poll(client::Now now) { return client_.poll(*this, now); }
  [[nodiscard]] transport::ClientPort& port() { return *port_; }
  [[nodiscard]] following::SessionClient& client() { return client_; }
  [[nodiscard]] const following::SessionClient& client() const { return client_; }
  /// True while it holds the state of frame() and what is queued leads to it.
  [[nodiscard]] bool playing() const { return plays_ && client_.playing(); }
  /// The frame of the state that the client holds.
  [[nodiscard]] Frame frame() const { return frame_; }
  /// The epoch that it plays; 0: none.
  [[nodiscard]] Epoch epoch() const { return plays_ ? epoch_ : 0; }
  [[nodiscard]] bool server_alive() const { return alive_; }
  void keep_state(bool on) { client_.keep_state(on); }
  /// A snapshot of frame() can be cut.
  [[nodiscard]] bool holds_state() const { return plays_ && client_.holds_state(); }
  /// What the server said of the stream last; empty before the first time.
  [[nodiscard]] const std::optional<transport::ServerStatusMessage>& status() const { return status_; }
  /// Deltas that were not taken yet, without a gap; the last is that of frame().
  [[nodiscard]] const std::deque<client::CompleteDelta>& queue() const { return queue_; }
  /// Takes the oldest; there has to be one.
  client::CompleteDelta take_oldest();
  /// Forgets all but the latest so many.
  void keep_latest(std::size_t count);
  /// Scheduled inputs that were not taken yet.
  [[nodiscard]] std::vector<transport::ScheduledInputMessage>& scheduled() { return scheduled_; }
  [[nodiscard]] std::vector<client::InputOutcome>& outcomes() { return outcomes_; }
  /// Counts joins from a snapshot.
  [[nodiscard]] std::uint64_t joins() const { return joins_; }

 private:
  void on_session(const transport::SessionMessage& session) override;
  void on_unplayed(const transport::SessionMessage& session) override { on_session(session); }
  void on_server_alive(bool alive) override { alive_ = alive; }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override;
  void on_scheduled(const transport::ScheduledInputMessage& input, std::int64_t now_ns) override;
  void on_applied(const client::CompleteDelta& delta, std::int64_t now_ns) override;
  void on_outcome(const client::InputOutcome& outcome, std::int64_t now_ns) override;
  void on_status(const transport::ServerStatusMessage& status, std::int64_t /*now_ns*/) override {
    status_ = status;
  }
  void lose();

  const std::uint32_t stream_;
  std::unique_ptr<transport::ClientPort> port_;
  following::SessionClient client_;
  bool alive_ = false;
  bool plays_ = false;
  Epoch epoch_ = 0;
  Frame frame_ = 0;
  std::deque<client::CompleteDelta> queue_;
  std::size_t queued_bytes_ = 0;
  std::vector<transport::ScheduledInputMessage> scheduled_;
  std::vector<client::InputOutcome> outcomes_;
  std::uint64_t joins_ = 0;
  std::optional<transport::ServerStatusMessage> status_;
};

/// All feeds of a session. The first stream is always followed, the others while somebody wants them. Inputs
/// go out through the client of the first. Sans-I/O but for the ports. Not thread-safe.
class Upstream {
 public:
  /// A stream that nobody wants any more is followed for so long.
  static constexpr std::int64_t kLingerNs = 5 * kSecond;
  /// A state that nobody needs any more is kept for so long: who joins seldom comes alone.
  static constexpr std::int64_t kStateNs = 10 * kSecond;

  struct Options {
    std::string session = "default";
    std::function<void(LogLevel, std::string_view)> log = {};
    std::int64_t (*measure_ns)() = nullptr;
    std::function<transport::ClientId()> new_id;  ///< random
    /// False: a stream has a state, and its hashes are checked, only while somebody needs snapshots of it.
    bool keeps_state = true;
    /// Streams that are followed at once, as others may play them already.
    std::vector<std::uint32_t> streams = {};
  };
  /// Makes a port for a client of that id.
  using MakePort = std::function<Result<std::unique_ptr<transport::ClientPort>>(transport::ClientId)>;

  /// Errors: those of `make_port`.
  static Result<std::unique_ptr<Upstream>> create(Options options, MakePort make_port);

  /// Takes what arrived. Returns when it wants to be called again.
  std::int64_t poll(client::Now now);
  /// The work that need not be done before what poll() took is passed on. Call it after each poll().
  void prepare();
  /// Of the last poll.
  [[nodiscard]] std::int64_t now_ns() const { return now_.steady_ns; }

  /// The session with all its streams; null before the first was heard. Valid until the next poll.
  [[nodiscard]] const transport::SessionMessage* session() const { return first().client().core().session(); }
  [[nodiscard]] Feed& first() { return *feeds_.begin()->second; }
  [[nodiscard]] const Feed& first() const { return *feeds_.begin()->second; }
  /// The feed of a stream; null while it is not followed.
  [[nodiscard]] Feed* feed(std::uint32_t stream);
  /// Follows the stream for kLingerNs from now at least. A failure is logged, and it is tried again.
  void want(std::uint32_t stream);
  /// The stream keeps a state for kStateNs from now at least; where it has none, it fetches one.
  void want_state(std::uint32_t stream);
  void each_feed(const std::function<void(Feed&)>& each);
  /// As long as nobody takes frames: follows all streams, and keeps their latest frames, `keep_ns` of them,
  /// for whoever will.
  void stand_by(std::int64_t keep_ns);

  /// Sends an input on behalf of its client; its outcome comes from take_outcomes().
  void send(const transport::InputMessage& input);
  void take_outcomes(std::vector<accounts::InputVerdict>& out);
  /// Inputs of another epoch are forgotten.
  void forget_inputs();
  /// Publishes what a client says of itself, for monitors of the session.
  void report(const transport::ClientStatusMessage& status) { first().client().report(status); }

 private:
  Upstream(Options options, MakePort make_port);
  Result<void> follow(std::uint32_t stream);
  [[nodiscard]] client::CoreOptions core_options(std::uint32_t stream, transport::ClientId id) const;

  Options options_;
  MakePort make_port_;
  client::Now now_;
  std::map<std::uint32_t, std::unique_ptr<Feed>> feeds_;  // by stream
  std::array<std::int64_t, transport::kMaxStreams> wanted_ns_{}, state_wanted_ns_{};
  following::InputMerger merger_;
  std::vector<accounts::InputVerdict> verdicts_;
};

}  // namespace tandem::relay
