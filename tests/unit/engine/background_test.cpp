// Tests steps on a thread of their own.
#include "services/engines/background/background.hpp"

#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "tests/unit/engine/worlds.hpp"

namespace tandem::engine {
namespace {

bool readable(int descriptor, int patience_ms) {
  pollfd asked{.fd = descriptor, .events = POLLIN, .revents = 0};
  return ::poll(&asked, 1, patience_ms) == 1;
}

TEST(Background, TheBodiesAreThoseOfStepsInTheForeground) {
  const auto plain = make(pile_world(500, 4));
  auto background = step_in_background(make(pile_world(500, 4)));
  ASSERT_TRUE(background) << background.error().message;
  Simulation& other = **background;
  for (int frame = 1; frame <= 50; ++frame) {
    if (frame == 20) {
      plain->apply(push_input({0, 2, 0}, 3, {0, 4, 1}));
      other.apply(push_input({0, 2, 0}, 3, {0, 4, 1}));
    }
    plain->step();
    other.begin_step();
    ASSERT_TRUE(readable(other.step_descriptor(), 10'000));
    while (!other.step_ready()) std::this_thread::yield();
    ASSERT_FALSE(readable(other.step_descriptor(), 0)) << "nothing is under way any more";
    ASSERT_TRUE(same_bodies(*plain, other)) << "frame " << frame;
    ASSERT_EQ(plain->colliding(), other.colliding());
  }
}

// Says whether two of its functions ran at a time.
class Watched final : public Simulation {
 public:
  explicit Watched(std::atomic<bool>& overlapped, std::atomic<bool>& holds)
      : overlapped_(&overlapped), holds_(&holds) {}
  [[nodiscard]] std::uint32_t capacity() const override { return 0; }
  [[nodiscard]] double dt_s() const override { return 1; }
  [[nodiscard]] Vec3 gravity() const override { return {}; }
  [[nodiscard]] Classification classify(const Input& /*input*/) const override {
    if (inside_) *overlapped_ = true;
    return {.reason = "asked after step " + std::to_string(steps_)};
  }
  void step() override {
    inside_ = true;
    while (*holds_) std::this_thread::yield();
    ++steps_;
    inside_ = false;
  }
  [[nodiscard]] Bodies bodies() const override { return {}; }
  [[nodiscard]] NewsFeatures tells() const override { return {.keys = false, .events = true}; }
  void tell(StepNews& news) override { news.broadcast(static_cast<std::uint32_t>(steps_)); }

 private:
  std::atomic<bool>* overlapped_;
  std::atomic<bool>* holds_;
  std::atomic<bool> inside_{false};
  int steps_ = 0;
};

TEST(Background, AnInputIsClassifiedAfterTheStepThatIsUnderWay) {
  std::atomic<bool> overlapped{false}, holds{true};
  auto background = step_in_background(std::make_unique<Watched>(overlapped, holds));
  ASSERT_TRUE(background);
  (*background)->begin_step();
  EXPECT_FALSE((*background)->step_ready());
  EXPECT_EQ((*background)->failure(), "");
  std::jthread releases([&holds] {
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
    holds = false;
  });
  EXPECT_EQ((*background)->classify({}).reason, "asked after step 1");
  EXPECT_FALSE(overlapped);
  EXPECT_TRUE((*background)->step_ready());
}

TEST(Background, TellsTheNewsOfTheStepThatWasMade) {
  struct Kinds final : StepNews {
    bool set_key(std::string_view /*key*/, std::span<const std::byte> /*value*/) override { return false; }
    bool remove_key(std::string_view /*key*/) override { return false; }
    bool broadcast(std::uint32_t kind, std::span<const std::byte> /*bytes*/,
                   std::optional<std::uint32_t> /*slot*/) override {
      told.push_back(kind);
      return true;
    }
    std::vector<std::uint32_t> told;
  };
  std::atomic<bool> overlapped{false}, holds{false};
  const auto background = step_in_background(std::make_unique<Watched>(overlapped, holds));
  ASSERT_TRUE(background);
  EXPECT_TRUE((*background)->tells().events);
  Kinds kinds;
  for (int i = 0; i < 2; ++i) {
    (*background)->begin_step();
    (*background)->tell(kinds);
  }
  EXPECT_EQ(kinds.told, (std::vector<std::uint32_t>{1, 2}));
}

TEST(Background, ItMayBeDestroyedDuringAStep) {
  std::atomic<bool> overlapped{false}, holds{true};
  auto background = step_in_background(std::make_unique<Watched>(overlapped, holds));
  ASSERT_TRUE(background);
  (*background)->begin_step();
  std::jthread releases([&holds] {
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
    holds = false;
  });
  background->reset();
}

}  // namespace
}  // namespace tandem::engine
