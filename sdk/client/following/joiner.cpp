#include "sdk/client/following/joiner.hpp"

#include <algorithm>
#include <utility>

namespace tandem::client {

void Joiner::start(std::int64_t now_ns) {
  held_.reset();
  patience_ns_ = kPatienceNs;
  ask_due_ns_ = attempt_ == 0 ? now_ns : std::max(now_ns, asked_ns_ + kMinSpacingNs);
  asked_ = false;
}

void Joiner::ask_again(std::int64_t now_ns) {
  held_.reset();
  const std::int64_t soon_ns = asked_ns_ + std::max(kMinSpacingNs, patience_ns_ / 4);
  ask_due_ns_ = std::min(ask_due_ns_, std::max(now_ns, soon_ns));
}

bool Joiner::poll(std::int64_t now_ns) {
  if (now_ns < ask_due_ns_) return false;
  if (asked_) patience_ns_ = std::min(2 * patience_ns_, kMaxPatienceNs);
  asked_ = true;
  asked_ns_ = now_ns;
  ask_due_ns_ = now_ns + patience_ns_;
  ++attempt_;
  return true;
}

void Joiner::progress(std::int64_t now_ns) { ask_due_ns_ = std::max(ask_due_ns_, now_ns + patience_ns_); }

void Joiner::offer(transport::SnapshotMessage&& snapshot) {
  if (!asked_) return;
  if (!held_ || snapshot.frame >= held_->frame) held_ = std::move(snapshot);
}

std::optional<transport::SnapshotMessage> Joiner::choose(std::optional<Frame> first_buffered,
                                                         std::int64_t now_ns) {
  if (!held_) return std::nullopt;
  if (first_buffered && held_->frame + 1 < *first_buffered) {
    ask_again(now_ns);
    return std::nullopt;
  }
  if (!first_buffered && now_ns < asked_ns_ + kQuietNs) return std::nullopt;
  return std::exchange(held_, std::nullopt);
}

std::int64_t Joiner::next_due_ns() const {
  return held_ ? std::min(ask_due_ns_, asked_ns_ + kQuietNs) : ask_due_ns_;
}

}  // namespace tandem::client
