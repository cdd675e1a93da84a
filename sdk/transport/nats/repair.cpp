#include "sdk/transport/nats/repair.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::transport::nats {

bool AskTimer::due(std::uint64_t first, std::uint32_t count, bool lost, std::int64_t now_ns) {
  if (!missing_ns_) missing_ns_ = now_ns;
  if (!lost && now_ns - *missing_ns_ < kGraceNs) return false;
  const bool asked = first >= first_ && first < end_;
  if (asked && first > first_) {  // the answer goes on
    first_ = first;
    asked_ns_ = now_ns;
    patience_ns_ = kLeastNs;
    return false;
  }
  if (asked) {
    if (now_ns - asked_ns_ < patience_ns_) return false;
    patience_ns_ = std::min(2 * patience_ns_, kMaxNs);
  } else {
    patience_ns_ = kLeastNs;
  }
  first_ = first;
  end_ = first + count;
  asked_ns_ = now_ns;
  return true;
}

void InputRepair::begin(std::uint64_t number) {
  if (begun_) return;
  begun_ = true;
  next_ = number + 1;
  advance();
}

bool InputRepair::came(std::uint64_t number) {
  if (!came_.insert(number).second) return false;
  if (begun_) advance();
  if (came_.size() > kMaxNoted) came_.erase(came_.begin());
  return true;
}

void InputRepair::advance() {
  while (came_.contains(next_)) ++next_;
}

void InputRepair::skip_to(std::uint64_t oldest) {
  if (!begun_ || oldest <= next_) return;
  next_ = oldest;
  advance();
}

std::uint32_t InputRepair::missing(std::uint64_t newest) const {
  if (!begun_ || next_ > newest) return 0;
  const auto after = came_.upper_bound(next_);
  const std::uint64_t end = after == came_.end() ? newest + 1 : std::min(newest + 1, *after);
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(end - next_, kMaxAsked));
}

void DeltaRepair::drop(std::map<Frame, Held>::iterator at) {
  for (const DeltaMessage& part : at->second.parts) held_bytes_ -= part.payload.size();
  held_.erase(at);
}

bool DeltaRepair::contradicts(const Held& held, const DeltaMessage& part) {
  if (held.parts.size() != part.parts) return true;
  const DeltaMessage& other = held.parts[part.part];
  return other.parts != 0 &&
         (other.hash != part.hash || other.last_input != part.last_input || other.payload != part.payload);
}

void DeltaRepair::take(DeltaMessage&& part, bool asked) {
  if (part.frame == 0 || (begun() && part.frame < next_)) return;
  if (!begun()) {
    if (part.part != 0) return;  // it subscribed in the middle of a frame
    next_ = part.frame;
  }
  if (part.frame - next_ >= kMaxFrames) return;
  newest_ = std::max(newest_, part.frame);
  auto found = held_.find(part.frame);
  if (found != held_.end() && contradicts(found->second, part)) {
    drop(found);
    if (!asked) return;
    found = held_.end();
  }
  if (found == held_.end() && held_bytes_ + part.payload.size() > kMaxHeldBytes && part.frame != next_)
    return;  // it is asked for again when there is room
  Held& held = held_[part.frame];
  if (held.parts.empty()) {
    held.parts.resize(part.parts);
    for (DeltaMessage& of : held.parts) of.parts = 0;
  }
  if (held.parts[part.part].parts != 0) return;
  held_bytes_ += part.payload.size();
  ++held.came;
  TANDEM_ASSERT(held.came <= held.parts.size() && part.frame >= next_);
  held.parts[part.part] = std::move(part);
}

void DeltaRepair::release(const InputRepair& inputs, std::vector<DeltaMessage>& out) {
  for (auto at = held_.begin(); at != held_.end() && at->first == next_ && at->second.whole();
       at = held_.begin()) {
    if (!inputs.complete_up_to(at->second.parts.front().last_input)) return;
    for (DeltaMessage& part : at->second.parts) {
      held_bytes_ -= part.payload.size();
      out.push_back(std::move(part));
    }
    held_.erase(at);
    ++next_;
  }
  TANDEM_ASSERT(!held_.empty() || held_bytes_ == 0);
}

void DeltaRepair::skip_to(Frame oldest) {
  if (!begun() || oldest <= next_) return;
  // What came of the frames in between is no use without those before.
  while (!held_.empty() && held_.begin()->first < oldest) drop(held_.begin());
  TANDEM_ASSERT(!held_.empty() || held_bytes_ == 0);
  next_ = oldest;
}

void DeltaRepair::exists(Frame newest) {
  if (begun()) newest_ = std::max(newest_, newest);
}

std::uint32_t DeltaRepair::missing() const {
  if (!begun() || next_ > newest_) return 0;
  Frame end = newest_ + 1;
  for (const auto& [frame, held] : held_) {
    if (!held.whole()) continue;
    end = frame;
    break;
  }
  return static_cast<std::uint32_t>(std::min<Frame>(end - std::min(end, next_), kMaxAsked));
}

std::optional<std::uint64_t> DeltaRepair::wanted_input() const {
  if (held_.empty() || held_.begin()->first != next_ || !held_.begin()->second.whole()) return std::nullopt;
  return held_.begin()->second.parts.front().last_input;
}

}  // namespace tandem::transport::nats
