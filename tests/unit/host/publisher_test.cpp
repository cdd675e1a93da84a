#include "services/host/outgoing/publisher.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

using namespace std::chrono_literals;

// Bounded: a broken publisher fails the test instead of hanging it.
void wait_until_empty(const Outbox& outbox) {
  for (int i = 0; i < 5000 && outbox.size() > 0; ++i) std::this_thread::sleep_for(1ms);
}

TEST(Publisher, WritesWhatIsQueuedInOrder) {
  Outbox outbox({.frames = 1000, .snapshots = 2, .control = 1000});
  FakePort port(participant(1));
  {
    Publisher publisher(outbox, port);
    for (Frame f = 1; f <= 500; ++f) {
      transport::DeltaMessage delta;
      delta.frame = f;
      ASSERT_TRUE(outbox.push(delta));
    }
    wait_until_empty(outbox);
    publisher.stop();
    EXPECT_EQ(publisher.failures(), 0U);
  }
  ASSERT_EQ(port.deltas.size(), 500U);
  for (std::size_t i = 0; i < 500; ++i) ASSERT_EQ(port.deltas[i].frame, i + 1);
}

TEST(Publisher, ARefusedDeltaIsWrittenAgainUntilItIsAccepted) {
  Outbox outbox({});
  FakePort port(participant(1));
  port.failing_writes = 3;
  Publisher publisher(outbox, port);
  ASSERT_TRUE(outbox.push(transport::DeltaMessage{}));
  ASSERT_TRUE(outbox.push(transport::ReplyMessage{}));
  for (int i = 0; i < 5000 && publisher.failures() < 3; ++i) std::this_thread::sleep_for(1ms);
  wait_until_empty(outbox);
  std::this_thread::sleep_for(20ms);
  publisher.stop();
  EXPECT_EQ(publisher.failures(), 3U);
  EXPECT_EQ(publisher.last_failure(), "refused by the test");
  ASSERT_EQ(port.order.size(), 2U);
  EXPECT_EQ(port.order[0], "delta");
}

TEST(Publisher, WhatTheMiddlewareRefusesForGoodEndsTheSessionInsteadOfBeingTriedForEver) {
  Outbox outbox({});
  FakePort port(participant(1));
  port.failing_writes = 1'000'000;
  Publisher publisher(outbox, port, 50ms);
  ASSERT_TRUE(outbox.push(transport::DeltaMessage{}));
  for (int i = 0; i < 5000 && !publisher.gave_up(); ++i) std::this_thread::sleep_for(1ms);
  EXPECT_TRUE(publisher.gave_up());
  EXPECT_GT(publisher.failures(), 1U);
}

TEST(Publisher, WhatOnlyTakesTimeIsTriedForAsLongAsItTakes) {
  Outbox outbox({});
  FakePort port(participant(1));
  port.failing_writes = 100;
  port.failure = ErrorCode::kTimeout;
  Publisher publisher(outbox, port, 1ms);
  ASSERT_TRUE(outbox.push(transport::DeltaMessage{}));
  ASSERT_TRUE(outbox.push(transport::ReplyMessage{}));
  wait_until_empty(outbox);
  publisher.stop();
  EXPECT_FALSE(publisher.gave_up());
  EXPECT_EQ(port.deltas.size(), 1U);
}

TEST(Publisher, StopsPromptlyEvenWhileAWriteKeepsFailing) {
  Outbox outbox({});
  FakePort port(participant(1));
  port.failing_writes = 1'000'000;
  Publisher publisher(outbox, port);
  ASSERT_TRUE(outbox.push(transport::DeltaMessage{}));
  for (int i = 0; i < 5000 && publisher.failures() == 0; ++i) std::this_thread::sleep_for(1ms);
  publisher.stop();
  EXPECT_GT(publisher.failures(), 0U);
  EXPECT_TRUE(port.deltas.empty());
}

}  // namespace
}  // namespace tandem::host
