#include "tests/fault/world/stage.hpp"

#include <utility>

namespace tandem::world {

Stage::Stage(const Settings& drawn)
    : settings(drawn),
      network({.seed = drawn.seed * 31 + 7, .link = drawn.link, .part_lifespan_ns = 300 * kMs}) {}

void Stage::blame(const char* invariant, std::string who, std::string what) {
  journal.add(now_ns, who, "BROKEN: " + std::string(invariant) + ": " + what);
  if (!finding) finding = Finding{invariant, std::move(who), std::move(what), now_ns};
}

}  // namespace tandem::world
