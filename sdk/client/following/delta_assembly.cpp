#include "sdk/client/following/delta_assembly.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::client {

namespace {

constexpr std::size_t kMaxPopped = 1024;

}  // namespace

transport::DeltaMessage to_message(const CompleteDelta& delta, Epoch epoch, const StreamId& stream) {
  transport::DeltaMessage message;
  message.epoch = epoch;
  message.stream = stream;
  message.frame = delta.frame;
  message.last_input = delta.last_input;
  message.server_time_ns = delta.server_time_ns;
  message.hash = delta.hash;
  message.payload = delta.payload;
  return message;
}

DeltaAssembly::Outcome DeltaAssembly::add(transport::DeltaMessage&& part) {
  const bool malformed = part.parts == 0 || part.part >= part.parts || part.frame == 0 ||
                         part.payload.size() > limits_.delta_bytes ||
                         (part.parts > 1 && part.payload.empty()) || part.quiet >= part.frame ||
                         part.quiet > limits_.quiet ||
                         (part.quiet > 0 && (part.parts > 1 || !part.payload.empty()));
  if (malformed) {
    clear();
    return Outcome::kRefused;
  }
  if (parts_ != 0) {
    const bool follows = part.frame == open_.frame && part.part == next_part_ && part.parts == parts_;
    if (follows) return append(std::move(part));
    if (part.frame < open_.frame || (part.frame == open_.frame && part.part < next_part_))
      return Outcome::kIgnored;
    return start_again(std::move(part), Outcome::kLostPart);
  }
  if (last_complete_ && part.frame <= *last_complete_) return Outcome::kIgnored;
  if (last_complete_ && part.frame - part.quiet > *last_complete_ + 1)
    return start_again(std::move(part), Outcome::kGap);
  if (part.part != 0) {
    // The client subscribed in the middle of a frame. Only at the very beginning this is not a loss.
    return last_complete_ ? start_again(std::move(part), Outcome::kLostPart) : Outcome::kIgnored;
  }
  return begin(std::move(part));
}

DeltaAssembly::Outcome DeltaAssembly::start_again(transport::DeltaMessage&& part, Outcome why) {
  clear();
  if (part.part != 0) return why;
  const Outcome outcome = begin(std::move(part));
  return outcome == Outcome::kStored ? why : outcome;
}

DeltaAssembly::Outcome DeltaAssembly::begin(transport::DeltaMessage&& part) {
  open_.frame = part.frame;
  open_.last_input = part.last_input;
  open_.server_time_ns = part.server_time_ns;
  open_.hash = part.hash;
  open_.payload = std::move(part.payload);
  parts_ = part.parts;
  next_part_ = 1;
  return parts_ == 1 ? finish(part.quiet) : Outcome::kStored;
}

DeltaAssembly::Outcome DeltaAssembly::append(transport::DeltaMessage&& part) {
  const bool agrees = part.last_input == open_.last_input && part.hash == open_.hash;
  if (!agrees || part.payload.size() > limits_.delta_bytes - open_.payload.size()) {
    clear();
    return Outcome::kRefused;
  }
  open_.payload.insert(open_.payload.end(), part.payload.begin(), part.payload.end());
  return ++next_part_ == parts_ ? finish(0) : Outcome::kStored;
}

// `quiet` frames in front of it that are not held changed nothing, so they have its hash.
DeltaAssembly::Outcome DeltaAssembly::finish(std::uint32_t quiet) {
  TANDEM_ASSERT(quiet < open_.frame && (quiet == 0 || open_.payload.empty()));
  const std::size_t most = std::max(limits_.total_bytes, 4 * limits_.delta_bytes);
  if (size() + quiet >= limits_.frames || queued_bytes_ + open_.payload.size() > most) {
    clear();
    return Outcome::kOverflow;
  }
  parts_ = 0;
  const Frame last = open_.frame;
  for (open_.frame = std::max(last - quiet, last_complete_.value_or(0) + 1); open_.frame < last;
       ++open_.frame) {
    open_.more = static_cast<std::uint32_t>(last - open_.frame);
    queue_.push_back(open_);
  }
  open_.more = 0;
  last_complete_ = last;
  queued_bytes_ += open_.payload.size();
  queue_.push_back(std::move(open_));
  open_ = {};
  high_water_ = std::max(high_water_, size());
  return Outcome::kStored;
}

void DeltaAssembly::pop() {
  queued_bytes_ -= queue_[first_].payload.size();
  queue_[first_++] = {};
  // Usually that was the only element. Otherwise the rest is moved down now and then, so that memory stays
  // bounded.
  if (first_ == queue_.size() || first_ >= kMaxPopped) {
    queue_.erase(queue_.begin(), queue_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
  }
}

void DeltaAssembly::drop_through(Frame frame) {
  while (size() > 0 && queue_[first_].frame <= frame) pop();
  if (!last_complete_ || *last_complete_ >= frame) return;
  last_complete_ = frame;
  if (parts_ == 0 || open_.frame > frame) return;
  open_ = {};
  parts_ = 0;
}

void DeltaAssembly::clear() {
  queue_.clear();
  first_ = 0;
  queued_bytes_ = 0;
  last_complete_.reset();
  open_ = {};
  parts_ = 0;
}

}  // namespace tandem::client
