#pragma once
// Changes from one stream to another while the first is played: idl/STATES.md, "Changing the stream".

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

#include "sdk/client/following/follower.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::client {

/// Holds the other stream until both are at the same frame. It only reads the one that is played, which goes
/// on whatever happens to the change. Not thread-safe.
class StreamChange {
 public:
  /// A change without progress for this time is given up.
  static constexpr std::int64_t kPatienceNs = 10 * kSecond;
  /// Maximum number of frames of the other stream that one poll applies, besides those of the stream that is
  /// played.
  static constexpr int kFramesPerPoll = 16;

  StreamChange(std::unique_ptr<Follower> to, double frame_rate_hz)
      : to_(std::move(to)), frame_rate_hz_(frame_rate_hz) {
    TANDEM_ASSERT(to_ != nullptr && to_->joining());
  }

  [[nodiscard]] Follower& to() {
    TANDEM_ASSERT(to_ != nullptr);  // false: the change has ended
    return *to_;
  }
  [[nodiscard]] const Follower& to() const {
    TANDEM_ASSERT(to_ != nullptr);
    return *to_;
  }
  /// Moves to() out, which ends the change.
  [[nodiscard]] std::unique_ptr<Follower> take() { return std::move(to_); }

  /// True when it is to be given up: nothing of its snapshot or its deltas has come for so long.
  /// `last_applied_ns`: when the stream that is played had its last frame.
  [[nodiscard]] bool gets_nowhere(std::int64_t now_ns, std::int64_t last_applied_ns);
  /// When to() plays: applies its frames up to that of the stream that is played, one at least. After each
  /// it asks `is_spent`, which may look at the frame. Done: to() can replace that stream.
  [[nodiscard]] Follower::Step catch_up(const Follower& played, const ScheduledInputs& scheduled,
                                        const std::function<bool(const ClientTimeline&)>& is_spent);

 private:
  std::unique_ptr<Follower> to_;
  double frame_rate_hz_;
};

}  // namespace tandem::client
