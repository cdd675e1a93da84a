#include "services/gateway/entrance/admission.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdio>
#include <fstream>

namespace tandem::gateway {
namespace {

constexpr std::int64_t kNow = 1'764'000'000;

Admission with(Secrets secrets, std::vector<std::string> origins = {}) {
  return {std::move(secrets), std::move(origins), "arena"};
}
Admission with_text(const std::string& token) { return with({.token = token, .keys = {}, .warnings = {}}); }

TEST(Admission, WithoutATokenEverybodyMayAct) {
  EXPECT_TRUE(with({}).pass("", kNow)->may_act);
  EXPECT_TRUE(with({}).pass("anything", kNow)->may_act);
}

TEST(Admission, OnlyTheWholeTokenFits) {
  const Admission admission = with_text("0123456789abcdef");
  EXPECT_TRUE(admission.pass("0123456789abcdef", kNow)->may_act);
  for (const char* wrong :
       {"", "0123456789abcde", "0123456789abcdeg", "1123456789abcdef", "0123456789abcdef0"})
    EXPECT_FALSE(admission.pass(wrong, kNow)) << wrong;
}

TEST(Admission, ASignedTokenSaysWhatItsHolderMay) {
  const auto key = *tokens::SecretKey::make();
  const Admission admission = with({.token = "0123456789abcdef", .keys = {key.public_key()}, .warnings = {}});
  tokens::Claims claims{
      .role = tokens::Role::kWatch, .not_before_s = kNow, .expires_s = kNow + 60, .name = "ann"};
  const auto watches = admission.pass(*tokens::sign(claims, key), kNow);
  ASSERT_TRUE(watches);
  EXPECT_FALSE(watches->may_act);
  EXPECT_EQ(watches->name, "ann");
  claims.role = tokens::Role::kAct;
  EXPECT_TRUE(admission.pass(*tokens::sign(claims, key), kNow)->may_act);
  EXPECT_TRUE(admission.pass("0123456789abcdef", kNow)->may_act) << "the text counts beside it";
  EXPECT_EQ(admission.pass(*tokens::sign(claims, *tokens::SecretKey::make()), kNow).error(),
            tokens::Denial::kWrong);
}

TEST(Admission, APassIsOverAtItsEndOrWithItsKey) {
  const auto key = *tokens::SecretKey::make(), other = *tokens::SecretKey::make();
  Admission admission = with({.token = {}, .keys = {key.public_key()}, .warnings = {}});
  const tokens::Claims claims{.not_before_s = kNow, .expires_s = kNow + 60};
  const Pass pass = *admission.pass(*tokens::sign(claims, key), kNow);
  const std::int64_t end_s = kNow + 60 + tokens::kClockToleranceS;
  EXPECT_EQ(admission.over(pass, end_s - 1), std::nullopt);
  EXPECT_EQ(admission.over(pass, end_s), tokens::Denial::kExpired);
  admission.change({.token = {}, .keys = {other.public_key(), key.public_key()}, .warnings = {}});
  EXPECT_EQ(admission.over(pass, kNow), std::nullopt);
  admission.change({.token = {}, .keys = {other.public_key()}, .warnings = {}});
  EXPECT_EQ(admission.over(pass, kNow), tokens::Denial::kWrong);
}

TEST(Admission, APassOfATextIsOverWhenTheTextChanges) {
  Admission admission = with_text("0123456789abcdef");
  const Pass pass = *admission.pass("0123456789abcdef", kNow);
  EXPECT_EQ(admission.over(pass, kNow + 1'000'000'000), std::nullopt);
  admission.change({.token = "another-text-of-16", .keys = {}, .warnings = {}});
  EXPECT_EQ(admission.over(pass, kNow), tokens::Denial::kWrong);
}

TEST(Admission, APageOfTheGatewaysOwnAddressIsLetIn) {
  const Admission admission = with({});
  EXPECT_TRUE(admission.origin_fits("", "127.0.0.1:8080")) << "no browser";
  EXPECT_TRUE(admission.origin_fits("http://127.0.0.1:8080", "127.0.0.1:8080"));
  EXPECT_TRUE(admission.origin_fits("http://localhost:8080", "LOCALHOST:8080"));
  EXPECT_TRUE(admission.origin_fits("https://[::1]:8080", "[::1]:8080"));
  EXPECT_TRUE(admission.origin_fits("https://192.168.1.5", "192.168.1.5"));
}

TEST(Admission, APageOfAnotherSiteIsNot) {
  const Admission admission = with({});
  EXPECT_FALSE(admission.origin_fits("http://evil.example", "127.0.0.1:8080"));
  EXPECT_FALSE(admission.origin_fits("http://127.0.0.1:9000", "127.0.0.1:8080"));
  EXPECT_FALSE(admission.origin_fits("null", "127.0.0.1:8080"));
  EXPECT_FALSE(admission.origin_fits("http://127.0.0.1:8080.evil.example", "127.0.0.1:8080"));
  EXPECT_FALSE(admission.origin_fits("http://", ""));
  EXPECT_FALSE(admission.origin_fits("http://[", "["));
}

TEST(Admission, ANameThatPointsHereIsLetInOnlyIfItIsListed) {
  EXPECT_FALSE(with({}).origin_fits("http://rebound.example:8080", "rebound.example:8080"));
  const Admission listed = with({}, {"https://lab.example"});
  EXPECT_TRUE(listed.origin_fits("https://Lab.example", "127.0.0.1:8080"));
  EXPECT_FALSE(listed.origin_fits("http://lab.example", "127.0.0.1:8080"));
  EXPECT_TRUE(with({}, {"*"}).origin_fits("http://evil.example", "127.0.0.1:8080"));
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

TEST(Admission, ATextThatEverybodyCanChangeIsRefused) {
  const std::string path = ::testing::TempDir() + "gateway-open-token";
  std::ofstream(path) << "0123456789abcdef\n";
  ASSERT_EQ(::chmod(path.c_str(), 0602), 0);
  const auto read = read_token(path);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("everybody can write it"), std::string::npos) << read.error().message;
  ASSERT_EQ(::chmod(path.c_str(), 0640), 0);
  EXPECT_TRUE(read_token(path));
  std::remove(path.c_str());
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);  // nobody writes into it, so this must not wait
  EXPECT_FALSE(read_token(path));
  std::remove(path.c_str());
}

}  // namespace
}  // namespace tandem::gateway
