#pragma once
// Holds the deltas and scheduled inputs of the last seconds, once for all viewers.

#include <cstddef>
#include <cstdint>
#include <deque>

#include "sdk/transport/units.hpp"
#include "services/gateway/viewing/outgoing.hpp"

namespace tandem::gateway {

/// The queue of every viewer is a place in this log; the messages behind it are still to be sent. So a slow
/// viewer costs no memory, and each message is held once. Bounded in bytes and in time. Not thread-safe.
class LiveLog {
 public:
  using Place = std::uint64_t;  ///< counts messages since the start; never goes back
  static constexpr std::int64_t kLongestNs = 10 * kSecond;

  explicit LiveLog(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Appends, and drops the oldest messages beyond the bounds, but never the newest.
  void push(OutgoingPtr message, std::int64_t now_ns);
  void clear();

  [[nodiscard]] Place begin() const { return begin_; }
  [[nodiscard]] Place end() const { return begin_ + entries_.size(); }
  /// `place` is one from begin() to end() - 1.
  [[nodiscard]] const OutgoingPtr& at(Place place) const { return entry(place).message; }
  [[nodiscard]] std::int64_t time_ns(Place place) const { return entry(place).at_ns; }
  /// The size of all messages from `place` on; `place` is from begin() to end().
  [[nodiscard]] std::size_t bytes_from(Place place) const {
    return place == end() ? 0 : pushed_ - entry(place).pushed_before;
  }

 private:
  struct Entry {
    OutgoingPtr message;
    std::int64_t at_ns = 0;
    std::size_t pushed_before = 0;  // bytes since the start
  };
  [[nodiscard]] const Entry& entry(Place place) const {
    return entries_[static_cast<std::size_t>(place - begin_)];
  }

  std::size_t most_bytes_;
  std::deque<Entry> entries_;
  Place begin_ = 0;
  std::size_t pushed_ = 0;  // bytes since the start
};

}  // namespace tandem::gateway
