#pragma once
// Which deltas of a stream clients have to acknowledge, and since when.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "sdk/core/layout/layout.hpp"

namespace tandem::host {

/// The last deltas that were queued for publication, by the frame that each leads to. Acknowledgements are
/// counted and timed against them. Bounded. Not thread-safe.
class SentFrames {
 public:
  static constexpr std::size_t kKept = 1025;  ///< more than any window

  struct Sent {
    Frame frame = 0;
    std::int64_t at_ns = 0;
  };

  /// A source that joined its own server anew may begin with frames that were sent before.
  void add(Frame frame, std::int64_t now_ns);
  /// How many deltas a client lacks that has applied all up to `applied`; at most kKept.
  [[nodiscard]] std::size_t beyond(Frame applied) const;
  /// The oldest of those that are kept; empty if it lacks none.
  [[nodiscard]] std::optional<Sent> first_beyond(Frame applied) const;

 private:
  [[nodiscard]] std::deque<Sent>::const_iterator after(Frame applied) const;

  std::deque<Sent> sent_;
};

}  // namespace tandem::host
