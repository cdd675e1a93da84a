#pragma once
// Remembers the clients whose inputs were taken lately, for a log.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::host {

/// Keeps the latest clients with the times of their last inputs. Not thread-safe.
class RecentSenders {
 public:
  static constexpr std::int64_t kLatelyNs = 10 * kSecond;
  static constexpr std::size_t kMaxKept = 64;  ///< above, the one that was silent for longest is forgotten
  static constexpr std::size_t kMaxNamed = 8;  ///< in one line

  void sent(transport::ClientId client, std::int64_t now_ns);
  /// The clients of the last kLatelyNs, the latest first, with the age of their last input; empty without
  /// any.
  [[nodiscard]] std::string names(std::int64_t now_ns) const;

 private:
  struct Sender {
    transport::ClientId client = 0;
    std::int64_t at_ns = 0;
  };
  std::vector<Sender> senders_;  // the latest last
};

}  // namespace tandem::host
