#include "services/gateway/entrance/addresses.hpp"

#include <gtest/gtest.h>

#include "sdk/wire/units.hpp"

namespace tandem::gateway {
namespace {

AddressKey key(std::string_view text) { return address_key(text).value(); }

TEST(Addresses, AnAddressIsOneOfIPv4OrTheNetworkOfOneOfIPv6) {
  EXPECT_EQ(key("192.0.2.1"), key(" 192.0.2.1:4711"));
  EXPECT_EQ(key("192.0.2.1"), key("::ffff:192.0.2.1"));
  EXPECT_NE(key("192.0.2.1"), key("192.0.2.2"));
  EXPECT_EQ(key("2001:db8::1"), key("[2001:db8::2:3]:80"));
  EXPECT_NE(key("2001:db8::1"), key("2001:db8:0:1::1"));
  for (const std::string_view bad : {"", "unknown", "1.2.3", "1.2.3.4.5", "[", "::g", "_hidden"})
    EXPECT_FALSE(address_key(bad)) << bad;
}

TEST(Addresses, OnlyATrustedProxyIsBelievedWhoComesThroughIt) {
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

TEST(Addresses, AnAddressHasSoManyConnectionsAndAQuarterOfThemInAHandshake) {
  Addresses addresses(AddressLimits{.connections = 8});
  AddressAccount& one = *addresses.of(key("192.0.2.1"));
  EXPECT_FALSE(addresses.arrive(one, 0));
  EXPECT_FALSE(addresses.arrive(one, 0));
  EXPECT_EQ(addresses.arrive(one, 0), TurnedAway::kHandshakes);
  EXPECT_FALSE(addresses.arrive(*addresses.of(key("192.0.2.2")), 0)) << "nobody else is kept out";
  Addresses::greeted(one);
  Addresses::greeted(one);
  for (int i = 0; i < 6; ++i) {
    EXPECT_FALSE(addresses.arrive(one, 0));
    Addresses::greeted(one);
  }
  EXPECT_EQ(addresses.arrive(one, 0), TurnedAway::kConnections);
  EXPECT_FALSE(addresses.arrive_behind_proxy(one));
  Addresses::leave(one, true);
  EXPECT_EQ(addresses.arrive(one, 0), TurnedAway::kArrivals) << "eight at once, four a second";
  EXPECT_FALSE(addresses.arrive(one, kSecond));
  Addresses::leave(one, false);
  EXPECT_EQ(one.handshakes, 0U);
  EXPECT_EQ(one.connections, 7U);
}

TEST(Addresses, ForgetsWhoIsGoneAndWouldBeTreatedAsNew) {
  Addresses addresses(AddressLimits{});
  const AccountPtr one = addresses.of(key("192.0.2.1"));
  EXPECT_FALSE(addresses.arrive(*one, kSecond));
  EXPECT_TRUE(one->joins.take(kSecond));
  addresses.forget(60 * kSecond);
  EXPECT_EQ(addresses.size(), 1U) << "it has a connection";
  Addresses::leave(*one, false);
  addresses.forget(kSecond);
  EXPECT_EQ(addresses.size(), 1U) << "its join is not forgotten";
  addresses.forget(60 * kSecond);
  EXPECT_EQ(addresses.size(), 0U);
}

TEST(Addresses, TheNumberOfAccountsIsBounded) {
  Addresses addresses(AddressLimits{});
  AddressKey address{};
  for (std::size_t i = 0; i < Addresses::kMaxAddresses + 10; ++i) {
    address[0] = static_cast<std::uint8_t>(i);
    address[1] = static_cast<std::uint8_t>(i >> 8U);
    address[2] = static_cast<std::uint8_t>(i >> 16U);
    EXPECT_TRUE(addresses.of(address));
  }
  EXPECT_EQ(addresses.size(), Addresses::kMaxAddresses);
}

TEST(Addresses, AFileLargerThanTheBurstIsPaidAfterwards) {
  AddressAccount account(AddressLimits{.bytes_per_second = 1000});
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
