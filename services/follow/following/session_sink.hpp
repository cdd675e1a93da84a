#pragma once
// What a session that is followed is offered to: a gateway, a relay, an archive.

#include <vector>

#include "sdk/client/following/delta_assembly.hpp"
#include "sdk/client/session/sent_inputs.hpp"
#include "sdk/wire/messages.hpp"

namespace tandem::following {

/// Is told in order what a SessionClient takes in of one stream. Every delta was applied and has the server's
/// hash, but for a client without a state (SessionClient::keep_state()). The calls come in
/// SessionClient::poll(), from its thread. A sink may ask its FollowedWorld meanwhile, and must not poll it.
class SessionSink {
 public:
  virtual ~SessionSink() = default;

  /// The session that is followed, with the one stream that is played; none, if this build can play none. It
  /// comes again with another stream, or for another epoch: then nothing that belongs to the last one is
  /// valid any more.
  virtual void on_session(const transport::SessionMessage& session) = 0;
  /// The session's bodies are called otherwise; nothing else of it changed.
  virtual void on_names(const std::vector<transport::BodyName>& names) = 0;
  /// The session's server can be heard, or no more.
  virtual void on_server_alive(bool alive) = 0;
  /// A snapshot was loaded: FollowedWorld::cut() is of that frame, and the next delta is of the one after it.
  virtual void on_snapshot(Frame /*frame*/) {}
  virtual void on_scheduled(const transport::ScheduledInputMessage& input, std::int64_t now_ns) = 0;
  virtual void on_applied(const client::CompleteDelta& delta, std::int64_t now_ns) = 0;
  /// Of an input that FollowedWorld::send() sent.
  virtual void on_outcome(const client::InputOutcome& outcome, std::int64_t now_ns) = 0;
  virtual void on_status(const transport::ServerStatusMessage& status, std::int64_t now_ns) = 0;
};

}  // namespace tandem::following
