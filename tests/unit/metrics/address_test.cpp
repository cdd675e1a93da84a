#include "services/program/metrics/address.hpp"

#include <gtest/gtest.h>

namespace tandem::metrics {
namespace {

TEST(MetricsAddress, APortAloneIsOneOfThisMachine) {
  const auto address = read_address("9730");
  ASSERT_TRUE(address);
  EXPECT_EQ(*address, (Address{"127.0.0.1", 9730}));
  EXPECT_TRUE(is_loopback(*address));
  EXPECT_EQ(*read_address("localhost:9730"), *address);
}

TEST(MetricsAddress, BothFamiliesAreRead) {
  EXPECT_EQ(*read_address("0.0.0.0:1"), (Address{"0.0.0.0", 1}));
  EXPECT_FALSE(is_loopback(*read_address("0.0.0.0:1")));
  EXPECT_EQ(*read_address("[::1]:65535"), (Address{"::1", 65535}));
  EXPECT_TRUE(is_loopback(*read_address("[::1]:65535")));
  EXPECT_EQ(to_text(*read_address("[fe80::1]:80")), "[fe80::1]:80");
  EXPECT_EQ(to_text(*read_address("10.0.0.1:80")), "10.0.0.1:80");
}

TEST(MetricsAddress, AnythingElseIsRefusedWithWhatIsExpected) {
  for (const char* text : {"", ":", ":80", "80:", "65536", "-1", "+80", "80 ", "0x50", "host:80", "1.2.3:80",
                           "::1:80", "[::1]", "[::1:80", "[]:80", "[127.0.0.1]:80", "127.0.0.1:80:80"}) {
    const auto address = read_address(text);
    ASSERT_FALSE(address) << text;
    EXPECT_EQ(address.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(address.error().message.find("ADDRESS:PORT"), std::string::npos);
  }
}

}  // namespace
}  // namespace tandem::metrics
