#pragma once
// One direction of a slow link, computed without a clock or packets of its own. Several paths of a simulated
// network may share one, as the users behind a home router do.

#include <cstddef>
#include <cstdint>
#include <optional>

namespace tandem::transport::simulated {

struct BottleneckOptions {
  double bits_per_s = 15e6;
  std::int64_t delay_ns = 5'000'000;   ///< one way
  std::int64_t queue_ns = 50'000'000;  ///< a packet that would wait longer than this is dropped
};

/// Packets leave one after the other at the link's rate and arrive a delay later.
class Bottleneck {
 public:
  explicit Bottleneck(const BottleneckOptions& options) : options_(options) {}

  /// A packet of `bytes` reaches the link. Returns when it arrives at the other end; empty if it is dropped.
  /// `now_ns` never goes back.
  [[nodiscard]] std::optional<std::int64_t> offer(std::int64_t now_ns, std::size_t bytes) {
    const std::int64_t starts_ns = free_ns_ > now_ns ? free_ns_ : now_ns;
    if (starts_ns - now_ns > options_.queue_ns) {
      ++dropped_;
      return std::nullopt;
    }
    free_ns_ = starts_ns + static_cast<std::int64_t>(static_cast<double>(bytes) * 8e9 / options_.bits_per_s);
    bytes_ += bytes;
    return free_ns_ + options_.delay_ns;
  }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }      ///< bytes let through so far
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }  ///< packets dropped so far

 private:
  BottleneckOptions options_;
  std::int64_t free_ns_ = 0;  // when the last packet has left
  std::uint64_t bytes_ = 0, dropped_ = 0;
};

}  // namespace tandem::transport::simulated
