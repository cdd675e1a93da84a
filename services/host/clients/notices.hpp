#pragma once
// Lines for a log, limited so that a log of months fits a disk.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "services/program/token_bucket.hpp"

namespace tandem::host {

/// Lines that one client may cause. Without the limit a client that joins and leaves in turn would fill a
/// disk.
inline constexpr accounts::TokenBucket kNoticesOfClient{0.1, 8};

/// Collects lines until they are taken. Lines above the limit are counted, and one line says how many were
/// left out. Not thread-safe.
class Notices {
 public:
  /// Limit of all clients and the server together; at most 17 MB a day.
  static constexpr double kPerSecond = 2;
  static constexpr double kBurst = 256;
  static constexpr std::size_t kMaxLines = 256;                   ///< maximum number of lines that wait to be
                                                                  ///< taken
  static constexpr std::int64_t kTellLeftOutNs = 10'000'000'000;  ///< minimum time between two lines about
                                                                  ///< lines left out

  void add(std::string line, std::int64_t now_ns);
  /// The same for what needs somebody's attention.
  void warn(std::string line, std::int64_t now_ns);
  /// Adds a line about a client; `of_client` has to permit it too.
  void add(std::string line, accounts::TokenBucket& of_client, std::int64_t now_ns);
  /// Returns the lines, oldest first, and forgets them.
  [[nodiscard]] std::vector<std::string> take();
  [[nodiscard]] std::vector<std::string> take_warnings();

 private:
  void add_to(std::vector<std::string>& lines, std::string line, std::int64_t now_ns);

  accounts::TokenBucket all_{kPerSecond, kBurst};
  std::vector<std::string> lines_, warnings_;
  std::uint64_t left_out_ = 0;
  std::int64_t told_ns_ = INT64_MIN / 2;
};

}  // namespace tandem::host
