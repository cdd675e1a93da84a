#include "services/host/outgoing/quiet_frames.hpp"

#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {

// A stream that is not made for a while begins anew, without a frame before.
bool QuietFrames::take(const Made& made) {
  const bool follows = before_ && before_->frame + 1 == made.frame;
  const bool quiet =
      follows && made.bytes == 0 && made.hash == before_->hash && made.last_input == before_->last_input;
  before_ = made;
  if (!follows) held_.reset();
  if (!quiet) return true;
  if (held_) {
    TANDEM_ASSERT(held_->last + 1 == made.frame && held_->hash == made.hash);
    held_->last = made.frame;
    ++held_->before;
  } else {
    held_ = Run{.last = made.frame, .before = 0, .hash = made.hash, .last_input = made.last_input};
  }
  return false;
}

std::optional<QuietFrames::Run> QuietFrames::release(bool all, std::int64_t now_ns) {
  if (!held_) return std::nullopt;
  if (!all && held_->before < most_ && now_ns - told_ns_ < kLongestNs) return std::nullopt;
  return std::exchange(held_, std::nullopt);
}

}  // namespace tandem::host
