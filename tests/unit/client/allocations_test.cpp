// No memory is asked for per frame or per sample.

#include <atomic>
#include <cstdlib>
#include <new>

#include "fake_server.hpp"
#include "taken.hpp"

namespace {

std::atomic<std::uint64_t> allocations{0};

}  // namespace

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace tandem::client {
namespace {

using ClientAllocations = ClientTest;

TEST_F(ClientAllocations, NoneInAFrameNorInASampleAfterTheFirst) {
  CoreOptions options;
  options.id = kClient;
  core = std::make_unique<ClientCore>(options, port);  // nobody listens: what they remember is theirs
  join();
  core->start_sampling();
  Taken sample;
  const SampleColumns columns = sample.make_room(40);
  port.acks.reserve(10'000);
  port.statuses.reserve(10'000);
  std::uint64_t in_frames = 0;
  std::uint64_t in_samples = 0;
  for (int i = 0; i < 400; ++i) {
    deliver(server.advance(wall_ns() + kFrameNs));
    const std::size_t reports = port.statuses.size();
    std::uint64_t before = allocations;
    poll(kFrameNs);
    // Once a second figures go out, as a message of their own.
    if (i > 60 && port.statuses.size() == reports) in_frames += allocations - before;
    before = allocations;
    for (const SampleMode mode : {SampleMode::kExtrapolate, SampleMode::kInterpolate})
      EXPECT_TRUE(core->sample({.mode = mode}, columns, {now_ns, wall_ns()}).has_value());
    if (i > 60) in_samples += allocations - before;
  }
  EXPECT_EQ(in_frames, 0U);
  EXPECT_EQ(in_samples, 0U);
  EXPECT_EQ(core->statistics().frames_applied, 400U);
}

}  // namespace
}  // namespace tandem::client
