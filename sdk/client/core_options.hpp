#pragma once
// What a client is told to do, and whom it tells.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "sdk/client/following/delta_assembly.hpp"
#include "sdk/client/session/resync_reason.hpp"
#include "sdk/client/session/sent_inputs.hpp"
#include "sdk/client/session/told_news.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/messages.hpp"
#include "tandem/client_types.hpp"

namespace tandem::client {

/// Both clocks at one moment.
struct Now {
  std::int64_t steady_ns = 0;  ///< never goes back
  std::int64_t wall_ns = 0;    ///< comparable with the server's stamps when both run on one host
};

inline constexpr std::uint32_t kObserverDelayMs = 200;

struct CoreOptions {
  std::string session;         ///< empty: the session that the port announces
  transport::ClientId id = 0;  ///< random, not 0; kept over rejoins and epochs
  transport::Role role = transport::Role::kParticipant;
  std::uint32_t lead = 1;
  std::string prefer;  ///< preferred stream: see read_preference()
  /// How long frames may be collected for this client, at most kMaxDelayMs. The picture is late by that much.
  /// A gateway collects for each client; over DDS, the client chooses one of a stream's offers by it. Empty:
  /// kObserverDelayMs for an observer, and 0 for a participant.
  std::optional<std::uint32_t> max_delay_ms = {};
  /// What the client may take on the network with all headers; kbit/s, 0: no cap, else as
  /// transport::is_cap().
  std::uint32_t cap_kbit_s = 0;
  /// A gateway holds the cap for its viewer, and lists one stream: the client does not choose by it.
  bool gateway_caps = false;
  bool echo = false;  ///< samples show a gravity that this client sent at once
  /// Threads for states and samples of many bodies; may be called by the poll and by sample() at the same
  /// time. Empty: none.
  RunBlocks run_blocks = {};
  bool keeps_state = true;                              ///< see ClientCore::keep_state()
  bool prepares = true;                                 ///< false: see ClientCore::prepare()
  std::function<void(LogLevel, std::string_view)> log;  ///< may be empty
  /// For `frame_cost` only: a monotonic clock in nanoseconds. Null: not measured.
  std::int64_t (*measure_ns)() = nullptr;

  [[nodiscard]] std::uint32_t delay_ms() const {
    return max_delay_ms.value_or(role == transport::Role::kObserver ? kObserverDelayMs : 0);
  }
};

/// Is told in order what a client takes in. For hash logs, recordings and tests. It must not call the client.
class CoreListener : public NewsListener {
 public:
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

}  // namespace tandem::client
