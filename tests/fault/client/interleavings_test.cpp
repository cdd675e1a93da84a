// Thousands of seeded interleavings of everything that can go wrong.
//   TANDEM_FAULT_SEED=N    replays one
//   TANDEM_FAULT_SEEDS=N   runs so many instead of the default
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "world.hpp"

namespace tandem::client {
namespace {

constexpr std::uint64_t kSeeds = 60;

std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

struct Sums {
  std::uint64_t frames = 0, acted = 0, resyncs = 0, repaired = 0, lost = 0;
};

/// One life of a session: a few seconds of trouble, then peace; all must be well in the end.
void live(std::uint64_t seed, Sums& sums) {
  Dice dice(seed);
  static constexpr const char* kCodecs[] = {"none",    "selective", "quantized",
                                            "entropy", "limited",   "tracker"};
  WorldOptions options;
  options.seed = seed;
  options.clients = 1 + static_cast<std::uint32_t>(dice.below(4));
  options.lead = static_cast<std::uint32_t>(dice.below(2));
  options.codec = kCodecs[dice.below(6)];
  options.link.delay_ns = static_cast<std::int64_t>(dice.uniform(0.1e6, 30e6));
  options.link.jitter_ns = static_cast<std::int64_t>(dice.uniform(0, 20e6));
  options.link.loss = dice.chance(0.5) ? dice.uniform(0, 0.1) : 0;
  options.link.repair_ns = static_cast<std::int64_t>(dice.uniform(5e6, 80e6));
  // Nothing repairs what a restarted server announced and lost for good, so it is either the one or the
  // other.
  const bool restarts = dice.chance(0.5);
  World world(options);
  world.run(2);
  if (!restarts) {
    auto hostile = options.link;
    hostile.loss = 0.1;
    hostile.lost_for_good = dice.uniform(0, 0.3);
    for (auto& client : world.clients()) world.network().set_link(world.server_id(), client->self(), hostile);
  }
  const std::uint64_t incidents = 4 + dice.below(12);
  for (std::uint64_t i = 0; i < incidents; ++i) {
    world.run(dice.uniform(0.02, 0.6));
    world.incident(restarts);
  }
  world.heal();
  // Discovery after a cut takes the lease; a demoted client keeps playing meanwhile.
  for (int second = 0; second < 15 && !world.not_playing().empty(); ++second) world.run(1);
  world.run(1);
  EXPECT_EQ(world.not_playing(), "");
  EXPECT_EQ(world.fault(), "");
  sums.frames += world.frame();
  sums.acted += world.inputs_acted();
  sums.resyncs += world.resyncs();
  sums.repaired += world.counts().repaired;
  sums.lost += world.counts().lost_for_good + world.counts().overwritten + world.counts().pushed_out;
}

TEST(Interleavings, EveryClientHoldsTheServersStateOnEveryFrameAndPlaysAgainInTheEnd) {
  const std::uint64_t replay = from_environment("TANDEM_FAULT_SEED", 0);
  const std::uint64_t first = replay != 0 ? replay : 1;
  const std::uint64_t count = replay != 0 ? 1 : from_environment("TANDEM_FAULT_SEEDS", kSeeds);
  Sums sums;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    SCOPED_TRACE("replay with TANDEM_FAULT_SEED=" + std::to_string(seed));
    live(seed, sums);
    if (HasFailure()) break;
  }
  std::cout << "seeds " << first << ".." << first + count - 1 << ": " << sums.frames << " frames, "
            << sums.acted << " inputs acted, " << sums.resyncs << " resyncs, " << sums.repaired
            << " samples repaired, " << sums.lost << " lost\n";
  if (count < 20) return;
  // The trouble was real.
  EXPECT_GT(sums.acted, 10U);
  EXPECT_GT(sums.resyncs, 10U);
  EXPECT_GT(sums.repaired, 1000U);
  EXPECT_GT(sums.lost, 10U);
}

}  // namespace
}  // namespace tandem::client
