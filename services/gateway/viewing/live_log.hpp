#pragma once
// Holds the deltas and scheduled inputs of the last seconds, once for all viewers.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/units.hpp"
#include "services/gateway/viewing/outgoing.hpp"

namespace tandem::gateway {

/// The queue of every viewer is a place in this log; the messages behind it are still to be sent. So a slow
/// viewer costs no memory, and each message is held once. Bounded in bytes and in time. Not thread-safe.
class LiveLog {
 public:
  using Place = std::uint64_t;  ///< counts messages since the start; never goes back
  /// As long as a relay keeps frames: a viewer whose connection was lost for less misses none.
  static constexpr std::int64_t kLongestNs = 30 * kSecond;

  explicit LiveLog(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Appends a delta, or a scheduled input, and drops the oldest messages beyond the bounds, but never the
  /// newest.
  /// `earlier`: frames in front of `frame` that the message tells, too. `payload_bytes`: of the delta.
  void push_delta(OutgoingPtr message, Frame frame, std::uint64_t last_input, std::int64_t now_ns,
                  std::uint32_t earlier = 0, std::size_t payload_bytes = 0);
  void push_input(OutgoingPtr message, std::uint64_t number, std::int64_t now_ns);
  void clear();

  /// Where a viewer that holds `frame` goes on, so that it gets all deltas after it and all scheduled inputs
  /// that it may lack, and some that it has. Empty: what follows that frame is not here, or not any more.
  /// Takes time proportional to the messages.
  [[nodiscard]] std::optional<Place> after(Frame frame) const;

  [[nodiscard]] Place begin() const { return begin_; }
  [[nodiscard]] Place end() const { return begin_ + entries_.size(); }
  /// `place` is one from begin() to end() - 1.
  [[nodiscard]] const OutgoingPtr& at(Place place) const { return entry(place).message; }
  [[nodiscard]] std::int64_t time_ns(Place place) const { return entry(place).at_ns; }
  /// Of a delta; 0: it is a scheduled input.
  [[nodiscard]] Frame frame(Place place) const { return entry(place).frame; }
  [[nodiscard]] std::uint32_t earlier(Place place) const { return entry(place).earlier; }
  /// The last scheduled input that a delta counts; of a scheduled input, its number.
  [[nodiscard]] std::uint64_t input(Place place) const { return entry(place).input; }
  /// Maximum size of what a delta adds to the payload of one that tells others, too.
  [[nodiscard]] std::size_t joined_bytes(Place place) const {
    constexpr std::size_t kHeadAndHash = 13;
    return entry(place).payload_bytes + kHeadAndHash;
  }
  /// The end of the deltas from `place` on, in front of `until`, that one of at most `max_frames` frames and
  /// `max_bytes` can tell; a larger one is alone. `until` is at most end().
  [[nodiscard]] Place shared_until(Place place, Place until, std::uint32_t max_frames,
                                   std::size_t max_bytes) const;
  /// The size of all messages from `place` on; `place` is from begin() to end().
  [[nodiscard]] std::size_t bytes_from(Place place) const {
    return place == end() ? 0 : pushed_ - entry(place).pushed_before;
  }

 private:
  struct Entry {
    OutgoingPtr message;
    Frame frame = 0;          // of a delta; 0: a scheduled input
    std::uint64_t input = 0;  // its number, or the last that the delta counts
    std::int64_t at_ns = 0;
    std::size_t pushed_before = 0;  // bytes since the start
    std::uint32_t earlier = 0;      // frames in front of `frame` that it tells, too
    std::size_t payload_bytes = 0;  // of a delta
    [[nodiscard]] bool tells(Frame told) const {
      return frame != 0 && frame - earlier <= told && told <= frame;
    }
  };
  void push(Entry entry);
  [[nodiscard]] const Entry& entry(Place place) const {
    TANDEM_ASSERT(begin_ <= place && place < end());
    return entries_[static_cast<std::size_t>(place - begin_)];
  }

  std::size_t most_bytes_;
  std::deque<Entry> entries_;
  bool whole_ = true;  // nothing was dropped since it was clear
  Place begin_ = 0;
  std::size_t pushed_ = 0;  // bytes since the start
};

}  // namespace tandem::gateway
