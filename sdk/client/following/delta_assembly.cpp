#include "sdk/client/following/delta_assembly.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/frame_bundle.hpp"

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
                         (part.parts > 1 && part.payload.empty()) || part.earlier >= part.frame ||
                         part.earlier > limits_.earlier || (part.earlier > 0 && part.parts > 1);
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
  if (last_complete_ && part.frame - part.earlier > *last_complete_ + 1)
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
  if (part.earlier > 0) return take_several(part);
  open_.frame = part.frame;
  open_.last_input = part.last_input;
  open_.server_time_ns = part.server_time_ns;
  open_.hash = part.hash;
  open_.payload = std::move(part.payload);
  parts_ = part.parts;
  next_part_ = 1;
  return parts_ == 1 ? finish() : Outcome::kStored;
}

DeltaAssembly::Outcome DeltaAssembly::append(transport::DeltaMessage&& part) {
  const bool agrees = part.last_input == open_.last_input && part.hash == open_.hash;
  if (!agrees || part.payload.size() > limits_.delta_bytes - open_.payload.size()) {
    clear();
    return Outcome::kRefused;
  }
  open_.payload.insert(open_.payload.end(), part.payload.begin(), part.payload.end());
  return ++next_part_ == parts_ ? finish() : Outcome::kStored;
}

bool DeltaAssembly::has_room(std::size_t frames, std::size_t bytes) const {
  const std::size_t most = std::max(limits_.total_bytes, 4 * limits_.delta_bytes);
  return size() + frames <= limits_.frames && queued_bytes_ + bytes <= most;
}

DeltaAssembly::Outcome DeltaAssembly::finish() {
  if (!has_room(1, open_.payload.size())) {
    clear();
    return Outcome::kOverflow;
  }
  parts_ = 0;
  last_complete_ = open_.frame;
  queued_bytes_ += open_.payload.size();
  queue_.push_back(std::move(open_));
  open_ = {};
  high_water_ = std::max(high_water_, size());
  return Outcome::kStored;
}

// All frames that are not held, or none.
DeltaAssembly::Outcome DeltaAssembly::take_several(const transport::DeltaMessage& message) {
  TANDEM_ASSERT(parts_ == 0 && message.part == 0);
  const std::vector<transport::FrameRun> runs = transport::read_frames(message);
  if (runs.empty() || !has_room(std::size_t{message.earlier} + 1, message.payload.size())) {
    clear();
    return runs.empty() ? Outcome::kRefused : Outcome::kOverflow;
  }
  for (const transport::FrameRun& run : runs) {
    const Frame first = std::max(run.last - run.before, last_complete_.value_or(0) + 1);
    for (Frame frame = first; frame <= run.last; ++frame) {
      CompleteDelta& delta = queue_.emplace_back();
      delta.frame = frame;
      delta.last_input = message.last_input;
      delta.more = static_cast<std::uint32_t>(message.frame - frame);
      delta.server_time_ns = transport::made_ns(message, frame, limits_.period_ns);
      delta.hash = run.hash;
      delta.payload.assign(run.payload.begin(), run.payload.end());
      queued_bytes_ += delta.payload.size();
    }
  }
  last_complete_ = message.frame;
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
