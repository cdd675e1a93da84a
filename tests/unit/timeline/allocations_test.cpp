#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "sdk/core/tables/codec_table.hpp"
#include "tests/unit/timeline/session.hpp"

namespace {

std::atomic<std::uint64_t> allocations{0};

}  // namespace

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
// std::stable_sort asks this way; a sanitizer's own would not match the operators delete below.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size);
}
// Not inlined: the compiler would take free() for a mistake.
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }
void operator delete[](void* memory) noexcept { operator delete(memory); }
void operator delete[](void* memory, std::size_t) noexcept { operator delete(memory); }

namespace tandem {
namespace {

using namespace synthetic;

TEST(Allocations, NoneInAFrameOfServerOrClientAfterTheFirst) {
  for (const std::string_view codec : codec_names()) {
    SCOPED_TRACE(codec);
    Random random(8);
    constexpr std::uint32_t kCapacity = 3000;
    const Layout layout = layout_for(codec, kCapacity);
    auto server = server_of(layout);
    auto client = client_of(layout);
    server.start(0, random_state(random, kCapacity), Drive{{0, -640, 0}, 10});
    ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
    std::uint64_t on_server = 0;
    std::uint64_t on_client = 0;
    for (Frame frame = 1; frame <= 100; ++frame) {
      State target = random_target(random, server.state(), 1 + random.below(20));
      const auto lifecycle = random_lifecycle(random, server.state(), target, 50);
      const std::size_t budget = random.one_in(2) ? kNoBudget : kPaperBudgetBytes;
      const ScheduledDrive input{frame, frame + 1, Drive{{0, static_cast<std::int32_t>(frame), 0}, 10}};

      if (random.one_in(10)) server.round_next();
      std::uint64_t before = allocations;
      const bool scheduled = server.schedule(input).has_value();
      const auto delta = server.advance(target, lifecycle, budget);
      if (frame > 1) on_server += allocations - before;

      before = allocations;
      client.step(1);
      const bool taken = client.schedule(input).has_value();
      const bool applied = apply(client, delta).has_value();
      client.step(1);
      if (frame > 1) on_client += allocations - before;
      ASSERT_TRUE(scheduled && taken && applied);
    }
    EXPECT_EQ(on_server, 0U);
    EXPECT_EQ(on_client, 0U);
  }
}

TEST(Allocations, TheCounterCounts) {
  const std::uint64_t before = allocations;
  const std::vector<int> memory(1000);
  EXPECT_GT(allocations, before);
  EXPECT_EQ(memory.size(), 1000U);
}

}  // namespace
}  // namespace tandem
