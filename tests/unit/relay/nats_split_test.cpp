#include "sdk/transport/nats/nats_split.hpp"

#include <gtest/gtest.h>

#include "tests/unit/relay/fake_nats.hpp"

namespace tandem::transport {
namespace {

std::vector<std::string> subjects_of(NatsBus& bus) {
  std::vector<NatsArrival> arrivals;
  bus.take(arrivals);
  std::vector<std::string> subjects;
  for (const NatsArrival& arrival : arrivals) subjects.push_back(arrival.subject);
  return subjects;
}

TEST(NatsSplit, EachHasWhatItSubscribedToAndTheConnectionHasItOnce) {
  FakeNats nats(1);
  NatsSplit split(nats.connect());
  const auto other = nats.connect();
  const auto first = split.share();
  auto second = split.share();
  ASSERT_TRUE(first->subscribe("beat") && first->subscribe("one"));
  ASSERT_TRUE(second->subscribe("beat") && second->subscribe("two"));
  const auto publish = [&] {
    for (const char* subject : {"one", "beat", "two", "three"})
      ASSERT_TRUE(other->publish(subject, Bytes(3, std::byte{5})));
    nats.now_ns += 1'000'000'000;
  };
  publish();
  EXPECT_EQ(subjects_of(*first), (std::vector<std::string>{"one", "beat"}));
  EXPECT_EQ(subjects_of(*second), (std::vector<std::string>{"beat", "two"}));
  second->unsubscribe("beat");
  publish();
  EXPECT_EQ(subjects_of(*first), (std::vector<std::string>{"one", "beat"}));
  EXPECT_EQ(subjects_of(*second), (std::vector<std::string>{"two"}));
  second.reset();
  publish();
  EXPECT_EQ(subjects_of(*first), (std::vector<std::string>{"one", "beat"}));
  ASSERT_TRUE(first->publish("four", Bytes(1)));
}

TEST(NatsSplit, OneThatOutlivesItGoesOn) {
  FakeNats nats(1);
  std::unique_ptr<NatsBus> bus;
  {
    NatsSplit split(nats.connect());
    bus = split.share();
  }
  ASSERT_TRUE(bus->subscribe("one"));
  ASSERT_TRUE(nats.connect()->publish("one", Bytes(1)));
  nats.now_ns += 1'000'000'000;
  EXPECT_EQ(subjects_of(*bus).size(), 1U);
}

}  // namespace
}  // namespace tandem::transport
