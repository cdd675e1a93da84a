#include "services/gateway/counts.hpp"

#include <fmt/format.h>

namespace tandem::gateway {

std::optional<std::string> CountLog::line(const Counts& counts, std::size_t viewers, std::int64_t now_ns) {
  if (!told_ns_) told_ns_ = now_ns - kPeriodNs;
  if (now_ns - *told_ns_ < kPeriodNs) return std::nullopt;
  std::string changes;
  const auto add = [&changes](std::uint64_t now, std::uint64_t told, std::string_view what) {
    if (now > told) changes += fmt::format(", {} {}", now - told, what);
  };
  add(counts.joined, told_.joined, "came");
  add(counts.left, told_.left, "left");
  add(counts.skips, told_.skips, "fell behind");
  add(counts.resumed, told_.resumed, "went on with what they held");
  add(counts.inputs_refused, told_.inputs_refused, "inputs refused");
  for (std::size_t i = 0; i < counts.refused.size(); ++i) {
    if (counts.refused[i] > told_.refused[i])
      changes += fmt::format(", {} refused: {}", counts.refused[i] - told_.refused[i], kClosings[i].reason);
  }
  for (std::size_t i = 0; i < counts.turned_away.size(); ++i) {
    if (counts.turned_away[i] > told_.turned_away[i])
      changes +=
          fmt::format(", {} turned away: {}", counts.turned_away[i] - told_.turned_away[i], kTurnedAway[i]);
  }
  if (changes.empty()) return std::nullopt;
  told_ = counts;
  told_ns_ = now_ns;
  return fmt::format("{} viewers{}", viewers, changes);
}

}  // namespace tandem::gateway
