// Tests the bottleneck of a link, by itself and under the simulated network.
#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "tests/unit/transport/simulated_pair.hpp"

namespace tandem::transport::simulated {
namespace {

TEST(Bottleneck, PacketsLeaveOneAfterTheOtherAtItsRate) {
  Bottleneck link({.bits_per_s = 8e6, .delay_ns = 5 * kMs, .queue_ns = 50 * kMs});
  EXPECT_EQ(link.offer(0, 1000), 6 * kMs) << "1 ms to leave, 5 ms on its way";
  EXPECT_EQ(link.offer(0, 2000), 8 * kMs) << "waits for the first";
  EXPECT_EQ(link.offer(100 * kMs, 1000), 106 * kMs) << "an idle link saves nothing up";
  EXPECT_EQ(link.bytes(), 4000U);
}

TEST(Bottleneck, DropsWhatWouldWaitTooLongAndNothingElse) {
  Bottleneck link({.bits_per_s = 8e6, .delay_ns = 0, .queue_ns = 50 * kMs});
  int taken = 0;
  while (link.offer(0, 1000)) ++taken;
  EXPECT_EQ(taken, 51) << "the one that leaves, and 50 ms of others";
  EXPECT_EQ(link.dropped(), 1U);
  EXPECT_FALSE(link.offer(0, 1));
  EXPECT_TRUE(link.offer(2 * kMs, 1000)) << "there is room as soon as packets have left";
  EXPECT_EQ(link.dropped(), 2U);
}

TEST(Bottleneck, CarriesItsRateHoweverMuchIsOffered) {
  Bottleneck link({});  // 15e6 bit/s, 50 ms
  for (std::int64_t ms = 0; ms < 10'000; ++ms) {
    for (int i = 0; i < 3; ++i) static_cast<void>(link.offer(ms * kMs, 1400));  // 33.6e6 bit/s
  }
  EXPECT_NEAR(8 * static_cast<double>(link.bytes()) / 10, 15e6, 0.01 * 15e6);
}

TEST(Bottleneck, IsSharedByAllPathsThatNameIt) {
  NetworkOptions options;
  options.link.delay_ns = 0;
  options.link.bottleneck = std::make_shared<Bottleneck>(BottleneckOptions{8e6, kMs, 1000 * kMs});
  Network network(options);
  const auto server = std::move(*network.make_server("s", 64));
  std::vector<std::unique_ptr<ClientPort>> clients;
  auto about = session();
  about.streams[0].max_delta_bytes = 10'000;
  EXPECT_TRUE(server->write(about));
  for (int i = 0; i < 2; ++i) {
    clients.push_back(std::move(*network.make_client("s", 64)));
    EXPECT_TRUE(open_stream(*clients.back(), about));
  }
  network.advance_to(100 * kMs);
  DeltaMessage large = delta(1);
  large.payload.resize(9'850);  // 10,000 bytes with what goes around it: 10 ms
  EXPECT_TRUE(server->write(large));
  network.advance_to(112 * kMs);
  EXPECT_EQ(frames(*clients[0]).size() + frames(*clients[1]).size(), 1U);
  network.advance_to(122 * kMs);
  EXPECT_EQ(frames(*clients[0]).size() + frames(*clients[1]).size(), 1U) << "the second waited for the first";
}

TEST(Bottleneck, WhatItDropsIsRepairedLater) {
  NetworkOptions options;
  options.link.delay_ns = 0;
  options.link.repair_ns = 20 * kMs;
  options.link.bottleneck = std::make_shared<Bottleneck>(BottleneckOptions{8e5, kMs, 5 * kMs});
  Pair pair(options, 1000);
  for (Frame frame = 1; frame <= 20; ++frame) ASSERT_TRUE(pair.server->write(delta(frame)));
  pair.run(1000 * kMs);
  EXPECT_EQ(frames(*pair.client), range(1, 20));
  EXPECT_GT(options.link.bottleneck->dropped(), 0U);
}

}  // namespace
}  // namespace tandem::transport::simulated
