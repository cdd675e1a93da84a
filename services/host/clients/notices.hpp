#pragma once
// Lines for a log, no more than it can bear for months.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/accounts/token_bucket.hpp"

namespace tandem::host {

/// What one client may say: by joining and leaving in turn it would fill a disk.
inline constexpr accounts::TokenBucket kNoticesOfClient{0.1, 8};

/// Collects lines until somebody takes them; what is too much is counted, and a line says how much. Not
/// thread-safe.
class Notices {
 public:
  /// Of all clients together, and of the server. 17 MB a day at most.
  static constexpr double kPerSecond = 2;
  static constexpr double kBurst = 256;
  static constexpr std::size_t kMostLines = 256;                  ///< that wait to be taken
  static constexpr std::int64_t kTellLeftOutNs = 10'000'000'000;  ///< between two lines about lines left out

  void add(std::string line, std::int64_t now_ns);
  /// A line about a client, which `of_client` has to permit, too.
  void add(std::string line, accounts::TokenBucket& of_client, std::int64_t now_ns);
  /// Oldest first; forgets them.
  [[nodiscard]] std::vector<std::string> take();

 private:
  accounts::TokenBucket all_{kPerSecond, kBurst};
  std::vector<std::string> lines_;
  std::uint64_t left_out_ = 0;
  std::int64_t told_ns_ = INT64_MIN / 2;
};

}  // namespace tandem::host
