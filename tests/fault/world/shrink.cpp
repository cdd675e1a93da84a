#include "tests/fault/world/shrink.hpp"

#include <algorithm>
#include <utility>

namespace tandem::world {

Plan shrink(Plan plan, const std::string& invariant, const std::function<Outcome(const Plan&)>& run) {
  const auto breaks = [&](const Plan& smaller) {
    const Outcome outcome = run(smaller);
    return outcome.finding && outcome.finding->invariant == invariant;
  };
  for (std::size_t length = std::max<std::size_t>(1, plan.size() / 2); !plan.empty();) {
    bool removed = false;
    for (std::size_t from = 0; from < plan.size();) {
      Plan smaller = plan;
      const auto first = smaller.begin() + static_cast<std::ptrdiff_t>(from);
      smaller.erase(first, first + static_cast<std::ptrdiff_t>(std::min(length, plan.size() - from)));
      if (breaks(smaller)) {
        plan = std::move(smaller);
        removed = true;
      } else {
        from += length;
      }
    }
    if (length == 1 && !removed) break;
    length = std::max<std::size_t>(1, length / 2);
  }
  return plan;
}

}  // namespace tandem::world
