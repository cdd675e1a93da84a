#include "sdk/workers/doorbell.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace tandem::transport {
namespace {

constexpr std::chrono::hours kForever{1};

TEST(Doorbell, RungBeforeOrOftenItEndsOneWait) {
  Doorbell bell;
  bell.ring();
  bell.ring();
  bell.wait(kForever);
  const auto began = std::chrono::steady_clock::now();
  bell.wait(std::chrono::milliseconds(2));
  EXPECT_GE(std::chrono::steady_clock::now() - began, std::chrono::milliseconds(2));
}

TEST(Doorbell, ATimeoutThatIsOverDoesNotWait) {
  Doorbell bell;
  bell.wait(std::chrono::nanoseconds(0));
  bell.wait(std::chrono::nanoseconds(-1));
  bell.ring();
  bell.wait(std::chrono::nanoseconds(0));  // takes the ring all the same
  const auto began = std::chrono::steady_clock::now();
  bell.wait(std::chrono::milliseconds(2));
  EXPECT_GE(std::chrono::steady_clock::now() - began, std::chrono::milliseconds(2));
}

TEST(Doorbell, EachRingOfAnotherThreadIsHeard) {
  Doorbell bell, heard;
  constexpr int kRings = 2000;
  std::atomic<int> rung = 0;
  std::thread other([&] {
    for (int i = 0; i < kRings; ++i) {
      ++rung;
      bell.ring();
      heard.wait(kForever);
    }
  });
  for (int i = 0; i < kRings; ++i) {
    bell.wait(kForever);
    EXPECT_EQ(rung, i + 1) << "one wait for each ring";
    heard.ring();
  }
  other.join();
}

}  // namespace
}  // namespace tandem::transport
