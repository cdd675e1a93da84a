#pragma once
// The interface of a gateway or relay to the session of which it is a client.

#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::following {

class FollowedWorld {
 public:
  virtual ~FollowedWorld() = default;

  /// True if it holds an agreed state and follows the session.
  [[nodiscard]] virtual bool playing() const = 0;
  /// The role that the server granted; an observer's inputs are refused.
  [[nodiscard]] virtual transport::Role role() const = 0;
  /// True if the outcome of every input that was sent in an earlier epoch was reported.
  [[nodiscard]] virtual bool inputs_settled() const = 0;
  /// The wall clock of the server's host at `now_ns`; empty while it is unknown.
  [[nodiscard]] virtual std::optional<std::int64_t> server_time_ns(std::int64_t now_ns) const = 0;

  /// The agreed state as a snapshot; empty unless playing with a state.
  struct Cut {
    StreamId stream;
    Frame frame = 0;
    std::uint64_t last_input = 0;  ///< scheduled inputs up to this number are in it
    transport::Bytes bytes;
  };
  [[nodiscard]] virtual std::optional<Cut> cut() = 0;

  /// Sends an input under the one client id that it has in the session; returns its number. Its outcome comes
  /// later.
  virtual Result<std::uint64_t> send(transport::InputKind kind, std::vector<double> values,
                                     transport::Bytes bytes, std::int64_t now_ns) = 0;
  /// Publishes the status of one that it serves, for monitors of the domain. Best effort.
  virtual void report(const transport::ClientStatusMessage& status) = 0;
};

}  // namespace tandem::following
