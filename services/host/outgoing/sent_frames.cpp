#include "services/host/outgoing/sent_frames.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {

void SentFrames::add(Frame frame, std::int64_t now_ns) {
  TANDEM_ASSERT(frame != 0);
  while (!sent_.empty() && sent_.back().frame >= frame) sent_.pop_back();
  sent_.push_back({frame, now_ns});
  if (sent_.size() > kKept) sent_.pop_front();
}

std::deque<SentFrames::Sent>::const_iterator SentFrames::after(Frame applied) const {
  return std::upper_bound(sent_.begin(), sent_.end(), applied,
                          [](Frame frame, const Sent& sent) { return frame < sent.frame; });
}

std::size_t SentFrames::beyond(Frame applied) const {
  return static_cast<std::size_t>(sent_.end() - after(applied));
}

std::optional<SentFrames::Sent> SentFrames::first_beyond(Frame applied) const {
  const auto first = after(applied);
  return first == sent_.end() ? std::nullopt : std::optional(*first);
}

}  // namespace tandem::host
