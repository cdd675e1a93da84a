// Frames and samples allocate no memory, and a sample that gets no memory leaves a client whole.

#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/support/client/fake_server.hpp"
#include "tests/support/client/taken.hpp"

namespace {

std::atomic<std::uint64_t> allocations{0};
std::atomic<std::int64_t> until_failure{
    -1};  ///< this many allocations succeed, then one fails; -1: none fails

bool fails() { return until_failure >= 0 && until_failure-- == 0; }

}  // namespace

void* operator new(std::size_t size) {
  ++allocations;
  if (fails()) throw std::bad_alloc();
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size);
}
// Not inlined: the compiler would take free() for a mistake.
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }
void operator delete[](void* memory) noexcept { operator delete(memory); }
void operator delete[](void* memory, std::size_t) noexcept { operator delete(memory); }

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

/// The first sample without memory for its n-th allocation, for one n after the other until it needs no more.
class ASampleWithoutMemory : public ClientTest {
 protected:
  void fail_each(Epoch first_epoch, Epoch epoch, std::uint32_t capacity) {
    for (std::int64_t n = 0;; ++n) {
      SCOPED_TRACE(n);
      if (epoch != first_epoch) {
        play(first_epoch, 40);
        ASSERT_TRUE(sample(40));
      }
      play(epoch, capacity);
      const SampleColumns columns = taken.make_room(capacity);
      until_failure = n;
      bool failed = false;
      try {
        core->start_sampling();
        failed = !core->sample({}, columns, {now_ns, wall_ns()}).has_value();
      } catch (const std::bad_alloc&) {
        failed = true;
      }
      const bool none_left = until_failure >= 0;
      until_failure = -1;
      ASSERT_EQ(failed, !none_left);
      if (none_left) {
        EXPECT_GE(n, 10);  // a column each
        return;
      }
      for (int i = 0; i < 3; ++i) frame();
      ASSERT_TRUE(sample(capacity));
      for (std::size_t slot = 0; slot < capacity; ++slot)
        ASSERT_EQ(taken.changes[slot] == BodyChange::kNew, taken.alive[slot] != 0);
      for (int i = 0; i < 3; ++i) frame();
      ASSERT_TRUE(sample(capacity));
      const State& agreed = core->timeline()->state(core->timeline()->applied());
      EXPECT_EQ(taken.alive, std::vector<std::uint8_t>(agreed.alive().begin(), agreed.alive().end()));
      core.reset();
    }
  }

 private:
  void play(Epoch epoch, std::uint32_t capacity) {
    server = FakeServer(epoch, capacity, 1, {.orientation = true});
    join();
    for (int i = 0; i < 3; ++i) frame();
  }
  [[nodiscard]] bool sample(std::uint32_t capacity) {
    core->start_sampling();
    const auto sampled = core->sample({}, taken.make_room(capacity), {now_ns, wall_ns()});
    return sampled.has_value() && sampled->capacity == capacity;
  }
  Taken taken;
};

TEST_F(ASampleWithoutMemory, LeavesAClientThatTheNextSampleDraws) { fail_each(1000, 1000, 40); }

TEST_F(ASampleWithoutMemory, OfALargerSessionLeavesOneToo) { fail_each(1000, 2000, 80); }

}  // namespace
}  // namespace tandem::client
