#pragma once
// The interface of those who receive a followed session: a gateway, a relay, a recording, the files of an
// audience.

#include "sdk/client/core_options.hpp"

namespace tandem::following {

/// Is told in order what a SessionClient takes in of one stream. Every delta was applied and has the server's
/// hash, but for a client without a state (SessionClient::keep_state()). The calls come in
/// SessionClient::poll(), from its thread. A sink may ask its FollowedWorld meanwhile, and must not poll it.
class SessionSink {
 public:
  virtual ~SessionSink() = default;

  /// The session that is followed, with the one stream that is played. It comes again with another stream, or
  /// for another epoch: then nothing that belongs to the last one is valid any more. Where the client plays
  /// already, FollowedWorld::cut() is of the frame before the next delta.
  virtual void on_session(const transport::SessionMessage& session) = 0;
  /// A session of which no stream is played: none is chosen yet, or this build can play none.
  virtual void on_unplayed(const transport::SessionMessage& /*session*/) {}
  /// The session of the last on_session() calls its bodies otherwise; nothing else of it changed.
  virtual void on_names(const transport::SessionMessage& /*session*/) {}
  /// The session's server can be heard, or no more.
  virtual void on_server_alive(bool /*alive*/) {}
  /// The client joins again: no delta comes before the next on_snapshot().
  virtual void on_resync(client::ResyncReason /*reason*/) {}
  /// A snapshot was loaded: FollowedWorld::cut() is of its frame, and the next delta is of the one after it.
  virtual void on_snapshot(const transport::SnapshotMessage& /*snapshot*/) {}
  virtual void on_scheduled(const transport::ScheduledInputMessage& /*input*/, std::int64_t /*now_ns*/) {}
  /// An event of the frame in the last on_applied().
  virtual void on_happened(const client::Happened& /*event*/, std::int64_t /*now_ns*/) {}
  virtual void on_applied(const client::CompleteDelta& /*delta*/, std::int64_t /*now_ns*/) {}
  /// Of an input that FollowedWorld::send() sent.
  virtual void on_outcome(const client::InputOutcome& /*outcome*/, std::int64_t /*now_ns*/) {}
  /// The server's status for the stream that is played; until one is played, its status for stream 0.
  virtual void on_status(const transport::ServerStatusMessage& /*status*/, std::int64_t /*now_ns*/) {}
  /// All that this poll took in was told.
  virtual void on_polled(client::Now /*now*/) {}
};

}  // namespace tandem::following
