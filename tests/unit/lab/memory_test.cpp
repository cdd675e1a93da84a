#include <gtest/gtest.h>

#include "sdk/core/codec/paper/code_tables.hpp"
#include "tests/bench/lab/memory.hpp"
#include "tests/unit/lab/bouncing.hpp"

namespace tandem::lab {
namespace {

Result<MemoryUse> measure(std::uint32_t bodies) {
  return measure_memory(
      [bodies]() -> Result<HostedSimulation> {
        HostedSimulation hosted;
        hosted.simulation = std::make_unique<Bouncing>(bodies);
        hosted.config.streams.resize(1);
        hosted.config.streams[0].lattice = *host::choose_lattice(0.05, 1000, Bouncing::kDt);
        hosted.config.streams[0].layout.parameters.codec =
            *host::codec_parameters(hosted.config.streams[0].lattice, 0.05, 0, 0);
        hosted.config.streams[0].layout.capacity = bodies;
        hosted.config.streams[0].layout.codec = "entropy";
        hosted.config.streams[0].layout.codec_tables = default_code_tables();
        return hosted;
      },
      20);
}

TEST(Memory, counts_at_least_what_the_state_needs_and_grows_with_the_slots) {
  const auto small = measure(1000);
  ASSERT_TRUE(small) << small.error().message;
  const auto large = measure(20000);
  ASSERT_TRUE(large) << large.error().message;
  constexpr double state_bytes = 1 + 1 + 2 + 9 * 4;  // alive, generation, type, p, v, c
  const auto more_a_slot = [&](std::int64_t MemoryUse::*part) {
    return static_cast<double>((*large).*part - (*small).*part) / 19000;
  };
  EXPECT_GT(more_a_slot(&MemoryUse::client_bytes), state_bytes);
  EXPECT_GT(more_a_slot(&MemoryUse::server_bytes), state_bytes);
  // Six float columns, alive and type.
  EXPECT_NEAR(more_a_slot(&MemoryUse::engine_bytes), 27, 1);
}

TEST(Memory, says_what_the_host_refuses) {
  const auto refused =
      measure_memory([]() -> Result<HostedSimulation> { return fail(ErrorCode::kIo, "no scene"); }, 1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "no scene");
}

}  // namespace
}  // namespace tandem::lab
