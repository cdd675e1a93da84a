#include "sdk/transport/network/address_watch.hpp"

#include <gtest/gtest.h>

namespace tandem::transport {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
const LocalAddress kLo{"lo", 1, "127.0.0.1", true}, kLo6{"lo", 1, "::1", true};
const LocalAddress kEth{"eth0", 2, "10.77.0.1", false}, kWlan{"wlan0", 3, "10.88.0.1", false};

/// Looks once a second.
class Watched {
 public:
  explicit Watched(BoundAddresses bound) : watch(std::move(bound)) {}
  NetworkState after(const std::vector<LocalAddress>& machine, std::int64_t seconds) {
    NetworkState state = NetworkState::kThere;
    for (std::int64_t i = 0; i <= seconds; ++i) state = watch.look(machine, now_ns += kSecond);
    return state;
  }
  AddressWatch watch;
  std::int64_t now_ns = 0;
};

TEST(AddressWatch, AnAddressThatStaysIsThereWhateverElseComes) {
  Watched eth({.addresses = {kEth}});
  EXPECT_EQ(eth.after({kLo, kEth, kWlan}, 100), NetworkState::kThere);
  EXPECT_EQ(eth.watch.line(), "");
}

TEST(AddressWatch, AnAddressThatLeavesMayComeBack) {
  Watched eth({.addresses = {kEth}});
  EXPECT_EQ(eth.after({kLo}, 100), NetworkState::kGone) << "to bind anew would not help";
  EXPECT_EQ(eth.watch.line(),
            "the network address that DDS is bound to (eth0 10.77.0.1) is gone from this machine");
  EXPECT_EQ(eth.after({kLo, kEth}, 0), NetworkState::kThere);
}

TEST(AddressWatch, TheSameAddressOnADeviceThatWasMadeAnewIsAnother) {
  Watched eth({.addresses = {kEth}, .chosen_by_user = true});
  const LocalAddress anew{"eth0", 9, "10.77.0.1", false};
  EXPECT_EQ(eth.after({kLo, anew}, 1), NetworkState::kGone) << "addresses may still come";
  EXPECT_EQ(eth.after({kLo, anew}, 3), NetworkState::kMoved);
}

TEST(AddressWatch, AnotherAddressOfTheInterfaceTakesItsPlaceOnceItStays) {
  Watched eth({.addresses = {kEth}, .chosen_by_user = true});
  const LocalAddress other{"eth0", 2, "10.77.0.9", false};
  EXPECT_EQ(eth.after({kLo, other}, 2), NetworkState::kGone);
  EXPECT_EQ(eth.after({kLo}, 100), NetworkState::kGone);
  EXPECT_EQ(eth.after({kLo, other}, 2), NetworkState::kGone);
  EXPECT_EQ(eth.after({kLo, other}, 1), NetworkState::kMoved);
  EXPECT_NE(eth.watch.line().find("it has eth0 10.77.0.9 now"), std::string::npos);
}

TEST(AddressWatch, AnotherInterfaceTakesItsPlaceUnlessTheUserNamedOne) {
  Watched any({.addresses = {kEth}}), named({.addresses = {kEth}, .chosen_by_user = true});
  EXPECT_EQ(any.after({kLo, kWlan}, 6), NetworkState::kMoved);
  EXPECT_EQ(named.after({kLo, kWlan}, 100), NetworkState::kGone);
}

TEST(AddressWatch, AddressesOfTheLinkAndOfTheOtherFamilyAreNoPlace) {
  Watched eth({.addresses = {kEth}});
  const LocalAddress zeroconf{"eth0", 2, "169.254.7.7", false}, v6{"eth0", 2, "fd77::1", false},
      link{"eth0", 2, "fe80::1", false};
  EXPECT_EQ(eth.after({kLo, zeroconf, v6, link}, 100), NetworkState::kGone);
  Watched of_the_link({.addresses = {zeroconf}});
  EXPECT_EQ(of_the_link.after({kLo, {"eth0", 9, "169.254.8.8", false}}, 6), NetworkState::kMoved);
}

TEST(AddressWatch, OfSeveralInterfacesOneMayGoButNotComeBackUnheard) {
  Watched both({.addresses = {kEth, kWlan}, .chosen_by_user = true});
  EXPECT_EQ(both.after({kLo, kWlan}, 100), NetworkState::kThere);
  EXPECT_EQ(both.after({kLo, kWlan, {"eth0", 9, "10.77.0.1", false}}, 6), NetworkState::kMoved);
}

TEST(AddressWatch, ALoopbackThatNobodyAskedForIsLeftForANetwork) {
  Watched lo({.stopgap = true});
  EXPECT_EQ(lo.after({kLo, kLo6, {"eth0", 2, "fe80::1", false}}, 100), NetworkState::kThere);
  EXPECT_EQ(lo.after({kLo, kEth}, 2), NetworkState::kThere);
  EXPECT_EQ(lo.after({kLo, kEth}, 1), NetworkState::kMoved);
  EXPECT_NE(lo.watch.line().find("eth0 10.77.0.1"), std::string::npos);
}

}  // namespace
}  // namespace tandem::transport
