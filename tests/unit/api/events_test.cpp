// The events that an application receives, and when.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdk/client/api/event_log.hpp"
#include "tests/support/playground/playground.hpp"

namespace tandem::api {
namespace {

constexpr std::array<double, 3> kDown{0, -9, 0};

class Events : public ::testing::Test {
 protected:
  Events() : client(playground.join()) {
    EXPECT_EQ(tandem_wait_until_playing(client, 10), TANDEM_OK) << tandem_error_text();
  }
  ~Events() override { EXPECT_EQ(tandem_leave(client), TANDEM_OK); }
  Events(const Events&) = delete;
  Events& operator=(const Events&) = delete;
  Events(Events&&) = delete;
  Events& operator=(Events&&) = delete;

  void run(double seconds) {
    for (const std::int64_t end_ns = Playground::now().steady_ns + static_cast<std::int64_t>(seconds * 1e9);
         Playground::now().steady_ns < end_ns;) {
      ASSERT_EQ(tandem_update(client, 0.01), TANDEM_OK) << tandem_error_text();
    }
  }
  std::vector<tandem_event> take() const {
    std::vector<tandem_event> events;
    for (tandem_event event = TANDEM_EVENT_INIT; tandem_next_event(client, &event) == TANDEM_OK;) {
      EXPECT_GT(event.at_ns, 0);
      events.push_back(event);
    }
    return events;
  }
  static std::vector<int> kinds(const std::vector<tandem_event>& events) {
    std::vector<int> kinds;
    for (const tandem_event& event : events) kinds.push_back(event.kind);
    return kinds;
  }

  Playground playground;
  tandem_client client;
};

TEST_F(Events, TheFirstIsThatItPlays) {
  const auto events = take();
  ASSERT_EQ(kinds(events), std::vector<int>{TANDEM_EVENT_PLAYING});
  EXPECT_NE(events[0].epoch, 0U);
  tandem_event event = TANDEM_EVENT_INIT;
  EXPECT_EQ(tandem_next_event(client, &event), TANDEM_NOT_READY);
}

TEST_F(Events, AnInputThatActedTellsItsFrame) {
  take();
  std::uint64_t number = 0;
  ASSERT_EQ(tandem_send_gravity(client, kDown.data(), &number), TANDEM_OK);
  EXPECT_EQ(number, 1U);
  run(1);
  const auto events = take();
  ASSERT_EQ(kinds(events), std::vector<int>{TANDEM_EVENT_INPUT_ACTED});
  EXPECT_EQ(events[0].number, number);
  EXPECT_GT(events[0].frame, 0U);
}

TEST_F(Events, AnInputThatIsRefusedTellsWhy) {
  take();
  const std::array<double, 3> much{1e6, 0, 0};
  ASSERT_EQ(tandem_send_gravity(client, much.data(), nullptr), TANDEM_OK);
  run(1);
  const auto events = take();
  ASSERT_EQ(kinds(events), std::vector<int>{TANDEM_EVENT_INPUT_REFUSED});
  EXPECT_EQ(events[0].reason, 3U);
  EXPECT_STREQ(events[0].text, "beyond 100") << "in the simulation's own words";
}

TEST_F(Events, ASeekIsRefusedWhereNothingIsReplayed) {
  take();
  std::uint64_t number = 0;
  ASSERT_EQ(tandem_send_seek(client, 2.5, &number), TANDEM_OK);
  run(1);
  const auto events = take();
  ASSERT_EQ(kinds(events), std::vector<int>{TANDEM_EVENT_INPUT_REFUSED});
  EXPECT_EQ(events[0].number, number);
  EXPECT_EQ(events[0].reason, 3U);
  EXPECT_NE(std::string(events[0].text), "") << "the simulation gave no words of its own";
}

TEST_F(Events, TheEndOfASessionAndAnotherEpochAreTold) {
  take();
  playground.stop_server();
  run(2);
  EXPECT_EQ(kinds(take()), std::vector<int>{TANDEM_EVENT_SESSION_ENDED});
  playground.start_server();
  run(5);
  const auto events = take();
  EXPECT_EQ(kinds(events), (std::vector<int>{TANDEM_EVENT_NEW_EPOCH, TANDEM_EVENT_PLAYING}));
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events[0].epoch, events.back().epoch);
}

// The server cannot wait so long: it goes on without this client, whose buffers are bounded.
TEST_F(Events, AnApplicationThatDidNotUpdateForAMinutePlaysAgainAndIsTold) {
  take();
  playground.pass(60);
  run(8);
  const auto events = kinds(take());
  const auto at = [&](int kind) { return std::find(events.begin(), events.end(), kind); };
  EXPECT_NE(at(TANDEM_EVENT_LOST), events.end());
  EXPECT_LT(at(TANDEM_EVENT_LOST), at(TANDEM_EVENT_REJOINED));
  EXPECT_NE(at(TANDEM_EVENT_REJOINED), events.end());
  tandem_status status = TANDEM_STATUS_INIT;
  ASSERT_EQ(tandem_get_status(client, &status), TANDEM_OK);
  EXPECT_EQ(status.phase, TANDEM_PLAYING);
  EXPECT_EQ(status.hash_mismatches, 0U);
}

TEST_F(Events, TheOldestAreDroppedAndCounted) {
  EventLog log;
  for (std::uint64_t number = 1; number <= EventLog::kMaxEvents + 44; ++number) {
    client::InputOutcome outcome;
    outcome.number = number;
    log.on_outcome(outcome);
  }
  EXPECT_EQ(log.dropped(), 44U);
  auto event = log.take();
  ASSERT_TRUE(event.has_value());
  EXPECT_EQ(event->number, 45U);
  EXPECT_EQ(event->dropped, 44U);
  event = log.take();
  EXPECT_EQ(event->number, 46U);
  EXPECT_EQ(event->dropped, 0U);
  for (std::size_t i = 2; i < EventLog::kMaxEvents; ++i) EXPECT_TRUE(log.take().has_value());
  EXPECT_FALSE(log.take().has_value());
}

// An exception within the client's work leaves it half-way. From then on it reports that, and does no harm.
TEST_F(Events, WithoutMemoryAClientStopsAndSaysSo) {
  playground.on_write = [] { throw std::bad_alloc(); };
  tandem_result result = TANDEM_OK;
  for (int i = 0; i < 1000 && result == TANDEM_OK; ++i) result = tandem_update(client, 0.01);
  EXPECT_EQ(result, TANDEM_OUT_OF_MEMORY);
  playground.on_write = nullptr;
  tandem_status status = TANDEM_STATUS_INIT;
  EXPECT_EQ(tandem_get_status(client, &status), TANDEM_OUT_OF_MEMORY);
  EXPECT_EQ(tandem_send_gravity(client, kDown.data(), nullptr), TANDEM_OUT_OF_MEMORY);
  EXPECT_EQ(tandem_wait_until_playing(client, 1), TANDEM_OUT_OF_MEMORY);
}

TEST_F(Events, AnExceptionWhileSendingEndsTheCallAlone) {
  playground.on_write = [] { throw std::runtime_error("the port broke"); };
  EXPECT_EQ(tandem_send_gravity(client, kDown.data(), nullptr), TANDEM_INTERNAL);
  EXPECT_STREQ(tandem_error_text(), "the port broke");
  playground.on_write = nullptr;
  EXPECT_EQ(tandem_send_gravity(client, kDown.data(), nullptr), TANDEM_OK);
}

}  // namespace
}  // namespace tandem::api
