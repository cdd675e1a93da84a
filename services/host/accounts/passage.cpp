#include "services/host/accounts/passage.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/parcels.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::accounts {
namespace {

// DDS repairs its losses. If nothing is heard for two round trips and a little, a part is sent again, so that
// a link that comes back is found soon.
constexpr std::int64_t kProbeNs = kSecond / 4;
constexpr std::int64_t kFirstProbeNs = kSecond;  // maximum
constexpr std::int64_t kMaxProbeNs = 2 * kSecond;
// After this time without an arrival the rate of the link is measured anew.
constexpr std::int64_t kForgetRateNs = 2 * kSecond;
// DDS repeats a part no longer than this, the lifespan of the writer.
constexpr std::int64_t kRepeatedNs = 3 * kSecond / 10;
// Maximum number of bytes sent to a receiver, in multiples of the snapshot's size.
constexpr std::size_t kMaxTimes = 4;
constexpr std::size_t kSlackBytes = 64U << 10U;

}  // namespace

Passage::Passage(std::size_t bytes, std::size_t part_bytes, std::int64_t now_ns)
    : bytes_(bytes),
      part_bytes_(part_bytes),
      holds_(transport::part_count(bytes, part_bytes)),
      began_ns_(now_ns),
      heard_ns_(now_ns),
      progress_ns_(now_ns),
      probed_ns_(now_ns) {
  TANDEM_ASSERT(bytes > 0 && part_bytes > 0);
}

std::size_t Passage::size_of(std::size_t part) const {
  TANDEM_ASSERT(part < holds_.size());
  return std::min(part_bytes_, bytes_ - part * part_bytes_);
}

void Passage::hold(std::size_t part) {
  if (!holds_[part]) ++held_;
  holds_[part] = true;
}

void Passage::acknowledged(std::span<const std::uint32_t> missing, std::int64_t now_ns) {
  heard_ns_ = now_ns;
  take_back(missing);
  arrived(transport::held_parts(missing, holds_.size()), now_ns);
  TANDEM_ASSERT(held_ == static_cast<std::size_t>(std::ranges::count(holds_, true)));
}

// A receiver that was sent damaged bytes drops all that it holds, and may hold the next part that comes.
void Passage::take_back(std::span<const std::uint32_t> missing) {
  transport::each_missing_run(missing, holds_.size(), [this](std::size_t part, std::size_t end) {
    for (; part < end; ++part) {
      if (!holds_[part]) continue;
      holds_[part] = false;
      --held_;
      again_.push_back(part);
    }
  });
}

// DDS delivers in the order of sending. A part that left before one that arrived, and has not arrived itself,
// is lost.
void Passage::arrived(const std::vector<bool>& held, std::int64_t now_ns) {
  std::size_t bytes = 0;
  std::size_t settled = 0;  // entries up to the last one that arrived
  std::vector<bool> is_new(holds_.size()), counts(flying_.size());
  const auto given_up = [now_ns](const Flying& entry) { return now_ns - entry.sent.at_ns >= kRepeatedNs; };
  for (std::size_t i = 0; i < flying_.size(); ++i) {
    const Flying& entry = flying_[i];
    if (!held[entry.part]) continue;
    const bool is_first = !holds_[entry.part];
    if (is_first) {
      hold(entry.part);
      is_new[entry.part] = counts[i] = true;
      bytes += entry.sent.bytes;
    }
    // A part that was sent twice counts as arrived by the last copy for which there was time, if DDS has
    // given up all that left before that copy.
    const bool by_copy = !is_first && is_new[entry.part] && given_up(flying_[i - 1]) &&
                         now_ns - entry.sent.at_ns >= window_.least_ns();
    if (is_first || by_copy) settled = i + 1;
  }
  std::erase_if(again_, [this, &held](std::size_t part) {  // the part was on its way after all
    if (held[part]) hold(part);
    return held[part];
  });
  if (settled == 0) return;
  progress_ns_ = probed_ns_ = now_ns;
  probes_ = 0;
  window_.arrived(bytes, flying_[settled - 1].sent, now_ns);
  for (std::size_t i = 0; i < settled; ++i) {
    if (!counts[i]) window_.lost(flying_[i].sent);
    if (!holds_[flying_[i].part]) again_.push_back(flying_[i].part);
  }
  flying_.erase(flying_.begin(), flying_.begin() + static_cast<std::ptrdiff_t>(settled));
  std::erase_if(flying_, [this](const Flying& entry) {  // sent twice
    if (holds_[entry.part]) window_.lost(entry.sent);
    return holds_[entry.part];
  });
}

std::optional<std::size_t> Passage::wanted() {
  while (!again_.empty() && holds_[again_.front()]) again_.pop_front();
  TANDEM_ASSERT(again_.empty() || again_.front() < unsent_);
  if (!again_.empty()) return again_.front();
  if (unsent_ < holds_.size()) return unsent_;
  return std::nullopt;
}

std::optional<std::size_t> Passage::next(std::int64_t now_ns) {
  window_.look(now_ns);
  if (const auto part = wanted()) {
    if (window_.admits(size_of(*part), now_ns)) {
      if (*part == unsent_) {
        ++unsent_;
      } else {
        again_.pop_front();
      }
      return send(*part, now_ns);
    }
  }
  if (flying_.empty() || now_ns < probe_ns() || !window_.within_limit(now_ns)) return std::nullopt;
  probed_ns_ = now_ns;
  ++probes_;
  if (now_ns - progress_ns_ >= kForgetRateNs) window_.start_over();
  return send(flying_.front().part, now_ns);
}

std::size_t Passage::send(std::size_t part, std::int64_t now_ns) {
  const std::size_t size = size_of(part);
  flying_.push_back({part, window_.sent(size, now_ns)});
  sent_bytes_ += size;
  return part;
}

std::int64_t Passage::probe_ns() const {
  const std::int64_t patience_ns = std::clamp(2 * window_.least_ns() + kSecond / 10, kProbeNs, kFirstProbeNs);
  return probed_ns_ + std::min(patience_ns << std::min(probes_, 3), kMaxProbeNs);
}

std::int64_t Passage::next_ns() const {
  const bool waits = !again_.empty() || unsent_ < holds_.size();
  const std::int64_t probe = flying_.empty() ? INT64_MAX : probe_ns();
  if (!waits || window_.is_full(part_bytes_)) return probe;
  return std::min(probe, window_.next_ns());
}

bool Passage::exhausted() const { return sent_bytes_ > kMaxTimes * bytes_ + kSlackBytes; }

}  // namespace tandem::accounts
