#include "services/gateway/entrance/visits.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace tandem::gateway::of_visits {
namespace {

AddressKey key(std::string_view text) { return address_key(text).value(); }

const AddressKey kOne = key("192.0.2.1"), kOther = key("192.0.2.2"), kProxy = key("10.0.0.1");

class VisitsTest : public testing::Test {
 protected:
  Visit& arrived(Visits& visits, const AddressKey& peer, std::int64_t now_ns = 0) {
    const auto visit = visits.arrive(peer, now_ns);
    EXPECT_TRUE(visit.has_value());
    return **visit;
  }
  std::vector<Visit*> slow(Visits& visits, std::int64_t now_ns) {
    std::vector<Visit*> list;
    visits.list_slow(now_ns, list);
    return list;
  }

  Visits visits_{AddressLimits{.connections = 8, .joins_per_minute = 2}, 6, {"10.0.0.1"}};
};

TEST_F(VisitsTest, CountInTheAccountOfTheirAddressUntilTheyLeave) {
  Visit& visit = arrived(visits_, kOne);
  const AccountPtr account = visit.account;
  EXPECT_EQ(account->connections, 1U);
  EXPECT_EQ(account->handshakes, 1U);
  visits_.ask(visit, "");
  EXPECT_EQ(account->handshakes, 0U);
  visits_.ask(visit, "");
  EXPECT_EQ(account->handshakes, 0U) << "another request is no other handshake";
  visits_.leave(&visit);
  EXPECT_EQ(account->connections, 0U);
  EXPECT_EQ(visits_.size(), 0U);
}

TEST_F(VisitsTest, LeavingWithinTheHandshakeEndsIt) {
  Visit& visit = arrived(visits_, kOne);
  const AccountPtr account = visit.account;
  visits_.leave(&visit);
  EXPECT_EQ(account->handshakes, 0U);
  visits_.leave(&visit);  // an address only
  visits_.leave(nullptr);
  EXPECT_EQ(account->connections, 0U);
}

TEST_F(VisitsTest, AnAddressBeyondItsLimitKeepsNobodyOut) {
  arrived(visits_, kOne);
  arrived(visits_, kOne);
  EXPECT_EQ(visits_.arrive(kOne, 0).error(), TurnedAway::kHandshakes);
  EXPECT_EQ(visits_.size(), 2U) << "who is turned away takes no place";
  EXPECT_TRUE(visits_.arrive(kOther, 0));
}

TEST_F(VisitsTest, AreNoMoreThanThereArePlaces) {
  for (int i = 1; i <= 6; ++i) arrived(visits_, key("198.51.100." + std::to_string(i)));
  EXPECT_EQ(visits_.arrive(kOne, 0).error(), TurnedAway::kFull);
  EXPECT_EQ(visits_.arrive(kProxy, 0).error(), TurnedAway::kFull);
}

TEST_F(VisitsTest, AreSlowOnceAfterThreeSecondsWithoutARequest) {
  Visit& silent = arrived(visits_, kOne);
  Visit& prompt = arrived(visits_, kOther);
  visits_.ask(prompt, "");
  EXPECT_TRUE(slow(visits_, Visits::kHandshakeNs - 1).empty());
  EXPECT_EQ(slow(visits_, Visits::kHandshakeNs), std::vector{&silent});
  EXPECT_TRUE(slow(visits_, 2 * Visits::kHandshakeNs).empty()) << "it is being ended";
}

TEST_F(VisitsTest, MayStayABitForAnotherRequest) {
  Visit& visit = arrived(visits_, kOne);
  visits_.ask(visit, "");
  Visits::answered(visit, kSecond);
  EXPECT_TRUE(slow(visits_, Visits::kKeptNs).empty());
  visits_.ask(visit, "");
  EXPECT_TRUE(slow(visits_, INT64_MAX - 1).empty()) << "what it asked for has a limit of its own";
  Visits::answered(visit, kSecond);
  EXPECT_EQ(slow(visits_, kSecond + Visits::kKeptNs), std::vector{&visit});
}

TEST_F(VisitsTest, ThroughAProxyCountWhoeverAsksAndOnlyIfTheyJoin) {
  Visit& visit = arrived(visits_, kProxy);
  EXPECT_EQ(visit.account->connections, 0U) << "a proxy has as many as it has clients";
  visits_.ask(visit, "192.0.2.1");
  EXPECT_EQ(visit.client, kOne);
  visits_.ask(visit, "192.0.2.2");
  EXPECT_EQ(visit.client, kOther);
  EXPECT_EQ(visit.account->connections, 0U);
  EXPECT_TRUE(visits_.join(visit, 0));
  const AccountPtr account = visit.account;
  EXPECT_EQ(account->connections, 1U);
  EXPECT_EQ(account->handshakes, 0U);
  visits_.leave(&visit);
  EXPECT_EQ(account->connections, 0U);
}

TEST_F(VisitsTest, OfAStrangerWhoNamesAnotherAddressAreHisOwn) {
  Visit& visit = arrived(visits_, kOne);
  visits_.ask(visit, "192.0.2.2");
  EXPECT_EQ(visit.client, kOne);
  EXPECT_TRUE(visits_.is_trusted(kProxy));
  EXPECT_FALSE(visits_.is_trusted(kOne));
}

TEST_F(VisitsTest, OfAnAddressJoinSoOftenAMinute) {
  for (int i = 0; i < 3; ++i) {
    Visit& visit = arrived(visits_, kOne);
    visits_.ask(visit, "");
    EXPECT_EQ(visits_.join(visit, 0), i < 2) << i;
    visits_.leave(&visit);
  }
}

TEST_F(VisitsTest, ThroughAProxyJoinAsLongAsTheClientHasPlaces) {
  Visits visits(AddressLimits{.connections = 1}, 6, {"10.0.0.1"});
  Visit& first = arrived(visits, kProxy);
  Visit& second = arrived(visits, kProxy);
  visits.ask(first, "192.0.2.1");
  visits.ask(second, "192.0.2.1");
  EXPECT_TRUE(visits.join(first, 0));
  EXPECT_FALSE(visits.join(second, 0));
  visits.leave(&second);
  EXPECT_EQ(first.account->connections, 1U) << "it was never counted";
}

TEST_F(VisitsTest, ByWhichTooMuchComesAreListedWhileTheirAddressIsOverItsLimit) {
  Visits visits(AddressLimits{.connections = 4}, 6, {});  // 64 KiB a second, 256 KiB at once
  Visit& flood = arrived(visits, kOne);
  visits.ask(flood, "");
  Visit& quiet = arrived(visits, kOne);
  visits.ask(quiet, "");
  Visit& other = arrived(visits, kOther);
  std::uint64_t received = 0;
  std::vector<Visit*> list;
  const auto tick = [&](std::int64_t now_ns) {
    visits.list_floods(
        now_ns, [&](const Visit& visit) { return &visit == &flood || &visit == &other ? received : 0; },
        list);
  };
  received = 250'000;
  tick(0);
  EXPECT_TRUE(list.empty()) << "a burst";
  received = 500'000;
  tick(kSecond / 10);
  EXPECT_EQ(list.size(), 2U);
  EXPECT_EQ(std::ranges::count(list, &quiet), 0);
  EXPECT_EQ(visits.arrive(kOne, kSecond / 10).error(), TurnedAway::kBytes);
  EXPECT_TRUE(visits.arrive(key("192.0.2.3"), kSecond / 10)) << "nobody else is kept out";
  tick(kSecond);
  EXPECT_TRUE(list.empty()) << "nothing more came";
  visits.leave(&flood);
  visits.leave(&other);
  visits.forget(5 * kSecond);
  EXPECT_TRUE(visits.arrive(kOne, 5 * kSecond)) << "it was paid back";
}

TEST_F(VisitsTest, WhoseFilesWaitAreListedOnceEach) {
  Visit& visit = arrived(visits_, kOne);
  std::vector<Visit*> list;
  visit.waits_for_bytes = true;
  visits_.list_waiting(list);
  EXPECT_EQ(list, std::vector{&visit});
  visits_.list_waiting(list);
  EXPECT_TRUE(list.empty());
}

TEST_F(VisitsTest, OfAProxyThatIsNoAddressAreNobodys) {
  Visits visits(AddressLimits{}, 6, {"proxy.example", ""});
  EXPECT_FALSE(visits.is_trusted(AddressKey{}));
}

}  // namespace
}  // namespace tandem::gateway::of_visits
