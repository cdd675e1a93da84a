#pragma once
// Something large travels in parts: how it is cut, which parts are missing, and how they become whole again.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/limits.hpp"

namespace tandem::transport {

/// The number of parts of `part_bytes`, of which the last may be smaller. Something empty is one empty part.
[[nodiscard]] constexpr std::size_t part_count(std::size_t bytes, std::size_t part_bytes) {
  TANDEM_ASSERT(part_bytes > 0);
  return std::max<std::size_t>((bytes + part_bytes - 1) / part_bytes, 1);
}
/// The bytes of a part, 0 .. part_count() - 1.
[[nodiscard]] inline std::span<const std::byte> part_of(std::span<const std::byte> whole,
                                                        std::size_t part_bytes, std::size_t part) {
  TANDEM_ASSERT(part < part_count(whole.size(), part_bytes));
  const auto rest = whole.subspan(part * part_bytes);
  return rest.first(std::min(part_bytes, rest.size()));
}
/// Makes `message` that part of `whole`; the rest of its fields stays. M: SnapshotMessage, CheckpointMessage.
template <class M>
void cut_part(std::span<const std::byte> whole, std::size_t part_bytes, std::size_t part, M& message) {
  const auto bytes = part_of(whole, part_bytes, part);
  message.part = static_cast<std::uint32_t>(part);
  message.parts = static_cast<std::uint32_t>(part_count(whole.size(), part_bytes));
  message.total_bytes = static_cast<std::uint32_t>(whole.size());
  message.bytes.assign(bytes.begin(), bytes.end());
}

/// What is not held, for an acknowledgement: runs of a first part and a count, ascending; the first
/// kMaxMissingRuns of them.
[[nodiscard]] std::vector<std::uint32_t> missing_runs(const std::vector<bool>& held);
/// Calls `visit(first, end)` for each run, cut to the parts that there are. Untrusted.
template <class Visit>
void each_missing_run(std::span<const std::uint32_t> runs, std::size_t parts, Visit&& visit) {
  for (std::size_t i = 0; i + 1 < runs.size(); i += 2) {
    const std::size_t first = std::min<std::size_t>(runs[i], parts);
    visit(first, first + std::min<std::size_t>(runs[i + 1], parts - first));
  }
}
/// For each part whether those runs say that it is held. The maximum number of runs says nothing about the
/// parts after the last run: they count as missing. Untrusted.
[[nodiscard]] inline std::vector<bool> held_parts(std::span<const std::uint32_t> runs, std::size_t parts) {
  std::vector<bool> held(parts, true);
  std::size_t told = 0;
  const auto lack = [&held](std::size_t first, std::size_t end) {
    std::fill(held.begin() + static_cast<std::ptrdiff_t>(first),
              held.begin() + static_cast<std::ptrdiff_t>(end), false);
  };
  each_missing_run(runs, parts, [&](std::size_t first, std::size_t end) {
    lack(first, end);
    told = std::max(told, end);
  });
  if (runs.size() >= 2 * kMaxMissingRuns) lack(told, parts);
  return held;
}

enum class ParcelOutcome : std::uint8_t {
  kStored,
  kIgnored,  ///< the part is of an older frame, is held already, or conflicts with the parts held
  kRefused,  ///< the part breaks a rule
};

/// Joins the parts of the newest frame that comes in. They may come in any order and repeatedly. Holds one
/// frame, and no more bytes than its parts declare. M: SnapshotMessage, CheckpointMessage; its bytes are
/// untrusted, but it is within_limits(). Not thread-safe.
template <class M>
class Parcels {
 public:
  /// Takes a part; a newer frame replaces an older one. kRefused: with it there were more bytes than the
  /// parts declare; it is not held.
  ParcelOutcome add(M&& part) {
    if (!held_.empty() && part.frame < head_.frame) return ParcelOutcome::kIgnored;
    const std::size_t number = std::exchange(part.part, 0);
    Bytes bytes = std::exchange(part.bytes, {});
    if (held_.empty() || part.frame > head_.frame)
      begin(std::move(part));
    else if (!(part == head_))
      return ParcelOutcome::kIgnored;
    if (number >= held_.size() || held_[number]) return ParcelOutcome::kIgnored;
    if (bytes.size() > head_.total_bytes - held_bytes_) return ParcelOutcome::kRefused;
    held_bytes_ += bytes.size();
    held_[number] = true;
    ++held_parts_;
    bytes_[number] = std::move(bytes);
    return ParcelOutcome::kStored;
  }
  /// Hands out the whole as part 0 of 1, once, when all parts are there. Afterwards they still count as held.
  /// It may be smaller than declared: see held_bytes().
  [[nodiscard]] std::optional<M> take() {
    if (!complete() || bytes_.empty()) return std::nullopt;
    M whole = head_;
    whole.parts = 1;
    whole.bytes.resize(held_bytes_);
    auto at = whole.bytes.begin();
    for (const Bytes& part : bytes_) at = std::copy(part.begin(), part.end(), at);
    bytes_ = {};
    return whole;
  }
  void clear() { *this = {}; }

  [[nodiscard]] bool empty() const { return held_.empty(); }  ///< no part has come
  [[nodiscard]] bool complete() const { return !empty() && held_parts_ == held_.size(); }
  /// The fields that all parts share.
  [[nodiscard]] const M& head() const { return head_; }
  [[nodiscard]] std::size_t held_bytes() const { return held_bytes_; }
  // For the acknowledgement.
  [[nodiscard]] Frame frame() const { return head_.frame; }
  [[nodiscard]] std::uint32_t parts() const { return static_cast<std::uint32_t>(held_.size()); }
  [[nodiscard]] std::vector<std::uint32_t> missing() const { return missing_runs(held_); }

 private:
  void begin(M&& head) {
    held_ = std::vector<bool>(head.parts);
    bytes_ = std::vector<Bytes>(head.parts);
    held_parts_ = held_bytes_ = 0;
    head_ = std::move(head);
  }

  M head_;
  std::vector<bool> held_;
  std::vector<Bytes> bytes_;  // by part; none once they were handed out
  std::size_t held_parts_ = 0, held_bytes_ = 0;
};

}  // namespace tandem::transport
