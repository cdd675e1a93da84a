#include "services/gateway/doors/admission.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

namespace tandem::gateway {
namespace {

TEST(Admission, WithoutATokenEverybodyFits) {
  EXPECT_TRUE(Admission("", {}).token_fits(""));
  EXPECT_TRUE(Admission("", {}).token_fits("anything"));
}

TEST(Admission, OnlyTheWholeTokenFits) {
  const Admission admission("0123456789abcdef", {});
  EXPECT_TRUE(admission.token_fits("0123456789abcdef"));
  for (const char* wrong :
       {"", "0123456789abcde", "0123456789abcdeg", "1123456789abcdef", "0123456789abcdef0"})
    EXPECT_FALSE(admission.token_fits(wrong)) << wrong;
}

TEST(Admission, APageOfTheGatewaysOwnAddressIsLetIn) {
  const Admission admission("", {});
  EXPECT_TRUE(admission.origin_fits("", "127.0.0.1:8080")) << "no browser";
  EXPECT_TRUE(admission.origin_fits("http://127.0.0.1:8080", "127.0.0.1:8080"));
  EXPECT_TRUE(admission.origin_fits("http://localhost:8080", "LOCALHOST:8080"));
  EXPECT_TRUE(admission.origin_fits("https://[::1]:8080", "[::1]:8080"));
  EXPECT_TRUE(admission.origin_fits("https://192.168.1.5", "192.168.1.5"));
}

TEST(Admission, APageOfAnotherSiteIsNot) {
  const Admission admission("", {});
  EXPECT_FALSE(admission.origin_fits("http://evil.example", "127.0.0.1:8080"));
  EXPECT_FALSE(admission.origin_fits("http://127.0.0.1:9000", "127.0.0.1:8080"));
  EXPECT_FALSE(admission.origin_fits("null", "127.0.0.1:8080"));
  EXPECT_FALSE(admission.origin_fits("http://127.0.0.1:8080.evil.example", "127.0.0.1:8080"));
  EXPECT_FALSE(admission.origin_fits("http://", ""));
  EXPECT_FALSE(admission.origin_fits("http://[", "["));
}

TEST(Admission, ANameThatPointsHereIsLetInOnlyIfItIsListed) {
  EXPECT_FALSE(Admission("", {}).origin_fits("http://rebound.example:8080", "rebound.example:8080"));
  const Admission listed("", {"https://lab.example"});
  EXPECT_TRUE(listed.origin_fits("https://Lab.example", "127.0.0.1:8080"));
  EXPECT_FALSE(listed.origin_fits("http://lab.example", "127.0.0.1:8080"));
  EXPECT_TRUE(Admission("", {"*"}).origin_fits("http://evil.example", "127.0.0.1:8080"));
}

TEST(Admission, OriginsHaveNoPath) {
  EXPECT_TRUE(check_origin("*"));
  EXPECT_TRUE(check_origin("https://lab.example:8443"));
  EXPECT_FALSE(check_origin("https://lab.example/"));
  EXPECT_FALSE(check_origin("lab.example"));
}

TEST(Admission, ATokenIsTheFirstLineOfItsFile) {
  const std::string path = ::testing::TempDir() + "gateway-token";
  const auto read = [&path](const char* text) {
    std::ofstream(path) << text;
    return read_token(path);
  };
  EXPECT_EQ(read("0123456789abcdef\nmore\n").value_or(""), "0123456789abcdef");
  EXPECT_FALSE(read("short\n"));
  EXPECT_FALSE(read("0123456789abcdef with spaces\n"));
  EXPECT_FALSE(read(""));
  std::remove(path.c_str());
  EXPECT_FALSE(read_token(path));
}

}  // namespace
}  // namespace tandem::gateway
