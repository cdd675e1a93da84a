#pragma once
// What client_core.cpp (session, acknowledgements, input, status) and client_stream.cpp (join and play)
// share.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "sdk/client/epoch_state.hpp"

namespace tandem::client {

inline constexpr std::int64_t kMillisecondNs = 1'000'000;
/// A scheduled input that a delta promised may be this late before the client joins again.
inline constexpr std::int64_t kInputPatienceNs = 250 * kMillisecondNs;
/// An acknowledgement is repeated after this, so that the server hears from a client even when no frame
/// comes.
inline constexpr std::int64_t kAckRepeatNs = 250 * kMillisecondNs;
inline constexpr std::int64_t kStatusPeriodNs = 1000 * kMillisecondNs;
/// Longest that poll() asks to sleep.
inline constexpr std::int64_t kMaxSleepNs = 50 * kMillisecondNs;

struct ClientCore::Impl {
  Impl(CoreOptions core_options, transport::ClientPort& client_port, CoreListener* core_listener)
      : options(std::move(core_options)),
        port(client_port),
        listener(core_listener != nullptr ? *core_listener : silent) {}

  // client_core.cpp
  void take_sessions(Now now);
  void adopt(const transport::Received<transport::SessionMessage>& announcement, Now now);
  void take_replies(Now now);
  void send_ack(Now now);
  void send_status(Now now);
  void report_outcomes();
  void log(LogLevel level, std::string_view line) const {
    if (options.log) options.log(level, line);
  }
  [[nodiscard]] ClientPhase phase() const;

  // client_stream.cpp
  void take_stream(Now now);
  void take_deltas(Now now);
  void take_scheduled(Now now);
  void take_snapshots(Now now);
  void join(Now now);
  void load(transport::SnapshotMessage&& snapshot, Now now);
  void play(Now now, std::int64_t since_last_poll_ns);
  void play_ahead(Now now);
  void rejoin(ResyncReason reason, const std::string& why, Now now);
  [[nodiscard]] std::int64_t next_due_ns(Now now) const;
  [[nodiscard]] std::int64_t measure() const {
    return options.measure_ns != nullptr ? options.measure_ns() : 0;
  }
  /// Counts and drops what is not of this epoch and this server.
  template <class M>
  [[nodiscard]] bool belongs(const transport::Received<M>& received) {
    if (received.from != epoch->server) {
      ++statistics.foreign_messages;
      return false;
    }
    if (received.message.epoch != epoch->session.epoch) {
      ++statistics.stale_messages;
      return false;
    }
    return true;
  }

  CoreOptions options;
  transport::ClientPort& port;
  CoreListener silent;
  CoreListener& listener;
  Statistics statistics;
  SentInputs sent;

  std::optional<transport::SessionMessage> session;  ///< last announcement, playable or not
  std::string refusal;                               ///< why it is not
  std::unique_ptr<EpochState> epoch;                 ///< null while there is no playable session

  bool server_alive = false;
  bool ack_due = false;
  std::int64_t last_ack_ns = 0;
  std::int64_t last_status_ns = 0;
  std::int64_t last_poll_ns = 0;
  std::int64_t poll_began_ns = 0;  ///< by options.measure_ns
  std::uint64_t status_bytes = 0;

  // Kept to reuse their memory.
  std::vector<transport::Received<transport::SessionMessage>> sessions;
  std::vector<transport::Received<transport::DeltaMessage>> deltas;
  std::vector<transport::Received<transport::ScheduledInputMessage>> inputs;
  std::vector<transport::Received<transport::SnapshotMessage>> snapshots;
  std::vector<transport::Received<transport::ReplyMessage>> replies;
  std::vector<InputOutcome> outcomes;
};

}  // namespace tandem::client
