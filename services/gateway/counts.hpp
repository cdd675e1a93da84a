#pragma once
// A gateway's counts since its start, and its lines in a log.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "sdk/wire/units.hpp"
#include "services/gateway/entrance/addresses.hpp"
#include "services/gateway/refusal.hpp"

namespace tandem::gateway {

struct Counts {
  std::uint64_t joined = 0, left = 0;  ///< viewers that were admitted
  std::array<std::uint64_t, kClosings.size()> refused{};
  std::array<std::uint64_t, kTurnedAway.size()> turned_away{};  ///< before they were viewers
  std::uint64_t stale = 0;                                      ///< messages of another epoch or stream
  std::uint64_t inputs = 0, inputs_refused = 0, inputs_sent = 0;
  std::uint64_t snapshots = 0;
  std::uint64_t skips = 0;    ///< viewers that fell behind
  std::uint64_t resumed = 0;  ///< viewers that went on with what they held from another connection
  std::uint64_t messages = 0, bytes = 0;  ///< to viewers

  [[nodiscard]] std::uint64_t& of(Refusal refusal) { return refused[static_cast<std::size_t>(refusal)]; }
  [[nodiscard]] std::uint64_t& of(TurnedAway why) { return turned_away[static_cast<std::size_t>(why)]; }
};

/// Writes a line about changes at most once a minute, so that strangers cannot fill a disk. Not thread-safe.
class CountLog {
 public:
  static constexpr std::int64_t kPeriodNs = 60 * kSecond;

  /// The line to write now, if there is one. `viewers`: connected now.
  [[nodiscard]] std::optional<std::string> line(const Counts& counts, std::size_t viewers,
                                                std::int64_t now_ns);

 private:
  Counts told_;
  std::optional<std::int64_t> told_ns_;
};

}  // namespace tandem::gateway
