#pragma once
// Engines that call over the network, until one of them shows the token.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "services/engines/door/channel.hpp"

namespace tandem::engine::door {

/// Anybody may call. So a caller has a limited time to say HELLO, the oldest of many has to go, and whoever
/// does not show the token gets one line and costs one line of the log in a second. Not thread-safe.
class Callers {
 public:
  using Clock = std::chrono::steady_clock;
  /// A caller that showed the token.
  struct Engine {
    Channel channel;
    std::vector<std::byte> hello;
  };
  static constexpr std::size_t kMaxCallers = 16;

  /// `token` is not empty.
  Callers(std::string token, std::chrono::nanoseconds limit) : token_(std::move(token)), limit_(limit) {}

  void add(Channel channel, Clock::time_point now);
  /// Hears the callers; returns the first that shows the token. `told` gets lines for the log.
  [[nodiscard]] std::optional<Engine> poll(Clock::time_point now, std::vector<std::string>& told);
  [[nodiscard]] bool empty() const { return callers_.empty(); }
  /// Some were turned away, for a reason that is told now or later.
  void turn_away(Channel& channel, const std::string& why, Clock::time_point now,
                 std::vector<std::string>& told);

 private:
  struct Caller {
    Channel channel;
    Clock::time_point since;
  };
  /// Empty: it is an engine that may come in.
  [[nodiscard]] std::string objection(std::span<const std::byte> hello) const;

  std::string token_;
  std::chrono::nanoseconds limit_;
  std::list<Caller> callers_;
  Clock::time_point told_{};
  std::uint64_t untold_ = 0;
};

/// A new one. Errors: kIo.
[[nodiscard]] Result<std::string> make_token();

}  // namespace tandem::engine::door
