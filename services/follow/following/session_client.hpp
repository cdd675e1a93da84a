#pragma once
// A session followed for sinks: a gateway, a relay, a recording, the files of an audience.

#include <cstdint>
#include <optional>
#include <span>

#include "sdk/client/client_core.hpp"
#include "sdk/wire/port.hpp"
#include "services/follow/following/session_sink.hpp"
#include "services/follow/following/world.hpp"

namespace tandem::following {

/// A ClientCore that reports its events to sinks in their order. Not thread-safe. The caller calls the
/// port's wait() and wake().
class SessionClient final : public FollowedWorld, private client::CoreListener {
 public:
  /// `port` must outlive it.
  SessionClient(client::CoreOptions options, transport::ClientPort& port);

  /// Takes what arrived and tells each of `sinks`. Returns when it wants to be called again.
  std::int64_t poll(std::span<SessionSink* const> sinks, client::Now now);
  std::int64_t poll(SessionSink& sink, client::Now now) {
    SessionSink* const one = &sink;
    return poll(std::span(&one, 1), now);
  }
  /// See ClientCore::prepare().
  void prepare() { core_.prepare(); }
  [[nodiscard]] const client::ClientCore& core() const { return core_; }
  /// See ClientCore::keep_state(). Without a state there is no cut().
  void keep_state(bool on) { core_.keep_state(on); }
  [[nodiscard]] bool holds_state() const { return core_.holds_state(); }

  [[nodiscard]] bool playing() const override { return core_.timeline() != nullptr; }
  [[nodiscard]] transport::Role role() const override;
  [[nodiscard]] bool inputs_settled() const override { return core_.inputs_settled(); }
  [[nodiscard]] std::optional<std::int64_t> server_time_ns(std::int64_t now_ns) const override;
  [[nodiscard]] std::optional<Cut> cut() override;
  Result<std::uint64_t> send(transport::InputKind kind, std::vector<double> values, transport::Bytes bytes,
                             std::int64_t now_ns) override;
  void report(const transport::ClientStatusMessage& status) override;

 private:
  void on_session(const transport::SessionMessage& session) override;
  void on_names(const transport::SessionMessage& session) override;
  void on_stream(const transport::StreamMessage& stream) override;
  void on_server_status(const transport::ServerStatusMessage& status) override;
  void on_resync(client::ResyncReason reason) override;
  void on_snapshot(const transport::SnapshotMessage& snapshot) override;
  void on_scheduled(const transport::ScheduledInputMessage& input) override;
  void on_applied(Epoch epoch, const client::CompleteDelta& delta) override;
  void on_happened(const client::Happened& event) override;
  void on_outcome(const client::InputOutcome& outcome) override;
  template <class... Parameters, class... Arguments>
  void tell(void (SessionSink::*what)(Parameters...), const Arguments&... arguments) {
    for (SessionSink* const sink : sinks_) (sink->*what)(arguments...);
  }

  transport::ClientPort& port_;
  client::ClientCore core_;
  std::optional<transport::SessionMessage> untold_;  // its stream comes next, or none is played
  std::optional<transport::SessionMessage> told_;    // with the stream that is played; empty: none is
  std::span<SessionSink* const> sinks_;              // during a poll
  std::int64_t now_ns_ = 0;                          // of it
};

}  // namespace tandem::following
