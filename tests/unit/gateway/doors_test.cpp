#include "services/gateway/doors/doors.hpp"

#include <gtest/gtest.h>

#include "sdk/wire/units.hpp"

namespace tandem::gateway {
namespace {

AddressKey key(std::string_view text) { return address_key(text).value(); }

TEST(Doors, AnAddressIsOneOfIPv4OrTheNetworkOfOneOfIPv6) {
  EXPECT_EQ(key("192.0.2.1"), key(" 192.0.2.1:4711"));
  EXPECT_EQ(key("192.0.2.1"), key("::ffff:192.0.2.1"));
  EXPECT_NE(key("192.0.2.1"), key("192.0.2.2"));
  EXPECT_EQ(key("2001:db8::1"), key("[2001:db8::2:3]:80"));
  EXPECT_NE(key("2001:db8::1"), key("2001:db8:0:1::1"));
  for (const std::string_view bad : {"", "unknown", "1.2.3", "1.2.3.4.5", "[", "::g", "_hidden"})
    EXPECT_FALSE(address_key(bad)) << bad;
}

TEST(Doors, OnlyATrustedProxyIsBelievedWhoComesThroughIt) {
  const std::vector<AddressKey> trusted{key("10.0.0.1"), key("10.0.0.2")};
  const auto client = [&](std::string_view peer, std::string_view forwarded_for) {
    return client_address(key(peer), forwarded_for, trusted);
  };
  EXPECT_EQ(client("192.0.2.1", "198.51.100.1"), key("192.0.2.1")) << "no proxy of ours";
  EXPECT_EQ(client("10.0.0.1", "198.51.100.1"), key("198.51.100.1"));
  EXPECT_EQ(client("10.0.0.1", "203.0.113.9, 198.51.100.1"), key("198.51.100.1")) << "the rest is hearsay";
  EXPECT_EQ(client("10.0.0.1", "203.0.113.9, 198.51.100.1,10.0.0.2"), key("198.51.100.1"));
  EXPECT_EQ(client("10.0.0.1", ""), key("10.0.0.1"));
  EXPECT_EQ(client("10.0.0.1", "10.0.0.2"), key("10.0.0.2"));
  EXPECT_EQ(client("10.0.0.1", "198.51.100.1, nonsense"), key("10.0.0.1")) << "it lies: its own account";
}

TEST(Doors, AnAddressHasSoManyConnectionsAndAQuarterOfThemInAHandshake) {
  Doors doors(DoorLimits{.connections = 8});
  AddressAccount& one = *doors.of(key("192.0.2.1"));
  EXPECT_FALSE(doors.arrive(one, 0));
  EXPECT_FALSE(doors.arrive(one, 0));
  EXPECT_EQ(doors.arrive(one, 0), TurnedAway::kHandshakes);
  EXPECT_FALSE(doors.arrive(*doors.of(key("192.0.2.2")), 0)) << "nobody else is kept out";
  Doors::greeted(one);
  Doors::greeted(one);
  for (int i = 0; i < 6; ++i) {
    EXPECT_FALSE(doors.arrive(one, 0));
    Doors::greeted(one);
  }
  EXPECT_EQ(doors.arrive(one, 0), TurnedAway::kConnections);
  EXPECT_FALSE(doors.arrive_behind_proxy(one));
  Doors::leave(one, true);
  EXPECT_EQ(doors.arrive(one, 0), TurnedAway::kArrivals) << "eight at once, four a second";
  EXPECT_FALSE(doors.arrive(one, kSecond));
  Doors::leave(one, false);
  EXPECT_EQ(one.handshakes, 0U);
  EXPECT_EQ(one.connections, 7U);
}

TEST(Doors, ForgetsWhoIsGoneAndWouldBeTreatedAsNew) {
  Doors doors(DoorLimits{});
  const AccountPtr one = doors.of(key("192.0.2.1"));
  EXPECT_FALSE(doors.arrive(*one, kSecond));
  EXPECT_TRUE(one->joins.take(kSecond));
  doors.forget(60 * kSecond);
  EXPECT_EQ(doors.addresses(), 1U) << "it has a connection";
  Doors::leave(*one, false);
  doors.forget(kSecond);
  EXPECT_EQ(doors.addresses(), 1U) << "its join is not forgotten";
  doors.forget(60 * kSecond);
  EXPECT_EQ(doors.addresses(), 0U);
}

TEST(Doors, TheNumberOfAccountsIsBounded) {
  Doors doors(DoorLimits{});
  AddressKey address{};
  for (std::size_t i = 0; i < Doors::kMaxAddresses + 10; ++i) {
    address[0] = static_cast<std::uint8_t>(i);
    address[1] = static_cast<std::uint8_t>(i >> 8U);
    address[2] = static_cast<std::uint8_t>(i >> 16U);
    EXPECT_TRUE(doors.of(address));
  }
  EXPECT_EQ(doors.addresses(), Doors::kMaxAddresses);
}

TEST(Doors, AFileLargerThanTheBurstIsPaidAfterwards) {
  AddressAccount account(DoorLimits{.bytes_per_second = 1000});
  EXPECT_TRUE(account.bytes.has(0));
  account.bytes.spend(6000);
  EXPECT_FALSE(account.bytes.has(kSecond));
  EXPECT_TRUE(account.bytes.has(3 * kSecond));
}

TEST(Addresses, AreWrittenAsPeopleDo) {
  EXPECT_EQ(address_text(*address_key("192.0.2.7:80")), "192.0.2.7");
  EXPECT_EQ(address_text(*address_key("::ffff:192.0.2.7")), "192.0.2.7");
  EXPECT_EQ(address_text(*address_key("2001:db8:1:2:3:4:5:6")), "2001:db8:1:2::/64");
}

}  // namespace
}  // namespace tandem::gateway
