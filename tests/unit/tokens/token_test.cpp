#include "services/credentials/tokens/token.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdio>
#include <fstream>

#include "services/credentials/tokens/base64url.hpp"
#include "services/credentials/tokens/secret_file.hpp"

namespace tandem::tokens {
namespace {

constexpr std::int64_t kNow = 1'764'000'000;

class Tokens : public ::testing::Test {
 protected:
  [[nodiscard]] static Claims eight_hours(Role role = Role::kAct) {
    return {.role = role, .not_before_s = kNow, .expires_s = kNow + 8 * 3600, .name = "alice"};
  }
  [[nodiscard]] Denial denial(std::string_view token, std::int64_t now_s = kNow) const {
    const auto checked = check(token, keys, "arena", now_s);
    EXPECT_FALSE(checked) << token;
    return checked ? Denial::kWrong : checked.error();
  }
  /// A payload that sign() would not make.
  [[nodiscard]] std::string signed_text(std::string_view payload) const {
    std::string token = "eyJhbGciOiJFZERTQSIsInR5cCI6IkpXVCJ9.";
    token += to_base64url({reinterpret_cast<const std::uint8_t*>(payload.data()), payload.size()});
    return token + '.' + to_base64url(key.sign(token));
  }

  SecretKey key = *SecretKey::make();
  std::vector<PublicKey> keys{SecretKey::make()->public_key(), key.public_key()};
};

TEST_F(Tokens, ComeBackAsTheyWereSigned) {
  const std::string token = *sign(eight_hours(Role::kWatch), key);
  const auto checked = check(token, keys, "arena", kNow);
  ASSERT_TRUE(checked);
  EXPECT_EQ(checked->claims.role, Role::kWatch);
  EXPECT_EQ(checked->claims.name, "alice");
  EXPECT_EQ(checked->claims.expires_s, kNow + 8 * 3600);
  EXPECT_EQ(checked->key, key.public_key().id());
  EXPECT_LT(token.size(), 300U);
}

TEST_F(Tokens, OfAnotherKeyAreWrong) {
  EXPECT_EQ(denial(*sign(eight_hours(), *SecretKey::make())), Denial::kWrong);
  EXPECT_FALSE(check(*sign(eight_hours(), key), {}, "arena", kNow));
}

TEST_F(Tokens, CountFromTheirBeginningToTheirEndAndAMinuteAround) {
  const std::string token = *sign(eight_hours(), key);
  const std::int64_t end_s = kNow + 8 * 3600;
  EXPECT_TRUE(check(token, keys, "arena", kNow - kClockToleranceS));
  EXPECT_TRUE(check(token, keys, "arena", end_s + kClockToleranceS - 1));
  EXPECT_EQ(denial(token, end_s + kClockToleranceS), Denial::kExpired);
  EXPECT_EQ(denial(token, kNow - kClockToleranceS - 1), Denial::kEarly);
  EXPECT_EQ(denial(token, kNow - 86'400), Denial::kEarly) << "of tomorrow";
}

TEST_F(Tokens, AreForOneSessionIfTheyNameIt) {
  Claims claims = eight_hours();
  claims.session = "arena";
  const std::string token = *sign(claims, key);
  EXPECT_TRUE(check(token, keys, "arena", kNow));
  EXPECT_EQ(check(token, keys, "other", kNow).error(), Denial::kSession);
}

TEST_F(Tokens, AnyChangedCharacterIsWrong) {
  const std::string token = *sign(eight_hours(), key);
  for (std::size_t i = 0; i < token.size(); ++i) {
    std::string changed = token;
    changed[i] = changed[i] == 'A' ? 'B' : 'A';
    EXPECT_EQ(denial(changed), Denial::kWrong) << i;
    EXPECT_EQ(denial(token.substr(0, i)), Denial::kWrong) << i;
  }
  EXPECT_EQ(denial(token + 'A'), Denial::kWrong);
  EXPECT_EQ(denial(token + '.'), Denial::kWrong);
  EXPECT_EQ(denial(token + "=="), Denial::kWrong);
}

TEST_F(Tokens, AMegabyteIsWrongUnseen) {
  EXPECT_EQ(denial(std::string(1U << 20U, 'A')), Denial::kWrong);
  EXPECT_EQ(denial("eyJhbGciOiJFZERTQSIsInR5cCI6IkpXVCJ9." + std::string(1U << 20U, 'A')), Denial::kWrong);
  EXPECT_EQ(denial(signed_text(std::string(2000, ' '))), Denial::kWrong);
}

TEST_F(Tokens, NobodyChoosesTheAlgorithm) {
  const std::string token = *sign(eight_hours(), key);
  const std::string rest = token.substr(token.find('.'));
  for (const std::string_view header : {R"({"alg":"none","typ":"JWT"})", R"({"alg":"HS256","typ":"JWT"})",
                                        R"({"typ":"JWT","alg":"EdDSA"})", R"({})"}) {
    const std::string other =
        to_base64url({reinterpret_cast<const std::uint8_t*>(header.data()), header.size()});
    EXPECT_EQ(denial(other + rest), Denial::kWrong) << header;
    EXPECT_EQ(denial(other + rest.substr(0, rest.rfind('.') + 1)), Denial::kWrong) << header;
  }
}

TEST_F(Tokens, SignedNonsenseIsDenied) {
  EXPECT_EQ(denial(signed_text(R"({"role":"admin","exp":2000000000})")), Denial::kRole);
  EXPECT_EQ(denial(signed_text(R"({"role":7,"exp":2000000000})")), Denial::kRole);
  EXPECT_EQ(denial(signed_text(R"({"exp":2000000000})")), Denial::kRole);
  EXPECT_EQ(denial(signed_text(R"({"role":"act"})")), Denial::kWrong) << "without an end";
  EXPECT_EQ(denial(signed_text(R"({"role":"act","exp":"2000000000"})")), Denial::kWrong);
  EXPECT_EQ(denial(signed_text(R"({"role":"act","exp":1e300})")), Denial::kWrong);
  EXPECT_EQ(denial(signed_text(R"({"role":"act","exp":2000000000,"aud":["arena"]})")), Denial::kSession);
  EXPECT_EQ(denial(signed_text("[1,2]")), Denial::kWrong);
  EXPECT_EQ(denial(signed_text("{")), Denial::kWrong);
  EXPECT_EQ(denial(""), Denial::kWrong);
  EXPECT_EQ(denial("..."), Denial::kWrong);
  EXPECT_TRUE(check(signed_text(R"({"role":"act","exp":2000000000,"more":{}})"), keys, "arena", kNow));
}

TEST_F(Tokens, AreMadeForALimitedTimeAndPlainNames) {
  Claims claims = eight_hours();
  claims.expires_s = claims.not_before_s;
  EXPECT_FALSE(sign(claims, key));
  claims.expires_s = claims.not_before_s + kLongestS + 1;
  EXPECT_FALSE(sign(claims, key));
  claims = eight_hours();
  claims.name = "two words";
  EXPECT_FALSE(sign(claims, key));
}

class KeyFiles : public ::testing::Test {
 protected:
  ~KeyFiles() override {
    std::remove(path.c_str());
    std::remove((path + ".pub").c_str());
  }
  [[nodiscard]] static unsigned mode(const std::string& file) {
    struct stat info = {};
    stat(file.c_str(), &info);
    return info.st_mode & 0777U;
  }
  SecretKey key = *SecretKey::make();
  std::string path = ::testing::TempDir() + "token-key-" + std::to_string(key.public_key().id());
};

TEST_F(KeyFiles, AreReadAsTheyWereWrittenAndNotOverwritten) {
  ASSERT_TRUE(key.write(path));
  EXPECT_EQ(mode(path), 0600U);
  EXPECT_EQ(mode(path + ".pub"), 0644U);
  EXPECT_EQ(SecretKey::read(path)->public_key().id(), key.public_key().id());
  EXPECT_EQ(PublicKey::read(path + ".pub")->id(), key.public_key().id());
  EXPECT_EQ(SecretKey::make()->write(path).error().code, ErrorCode::kConflict);
  EXPECT_EQ(SecretKey::read(path)->public_key().id(), key.public_key().id());
}

TEST_F(KeyFiles, ASecretThatOthersCanReadIsRefusedWithTheCure) {
  ASSERT_TRUE(key.write(path));
  for (const unsigned open : {0644U, 0640U, 0602U}) {
    ASSERT_EQ(chmod(path.c_str(), open), 0);
    const auto read = SecretKey::read(path);
    ASSERT_FALSE(read);
    EXPECT_NE(read.error().message.find("chmod 600 " + path), std::string::npos) << read.error().message;
  }
}

TEST_F(KeyFiles, APublicKeyThatEverybodyCanWriteIsRefused) {
  ASSERT_TRUE(key.write(path));
  ASSERT_EQ(chmod((path + ".pub").c_str(), 0666), 0);
  EXPECT_FALSE(PublicKey::read(path + ".pub"));
}

TEST_F(KeyFiles, WhatIsNoKeyIsNamed) {
  ASSERT_TRUE(key.write(path));
  const auto secret = PublicKey::read(path);
  ASSERT_FALSE(secret);
  EXPECT_NE(secret.error().message.find("the secret key"), std::string::npos);
  const std::string whole = *read_file(path + ".pub", Others::kAnything);
  for (const std::size_t size : {std::size_t{0}, std::size_t{10}, whole.size() / 2, whole.size() - 10}) {
    std::ofstream(path + ".pub") << whole.substr(0, size);
    EXPECT_FALSE(PublicKey::read(path + ".pub")) << size;
  }
  EXPECT_FALSE(PublicKey::read(path + ".missing"));
  EXPECT_FALSE(PublicKey::read(::testing::TempDir()));
}

}  // namespace
}  // namespace tandem::tokens
