#include "sdk/transport/nats/followers.hpp"

#include <gtest/gtest.h>

#include "sdk/transport/nats/site_proof.hpp"

namespace tandem::transport::nats {
namespace {

TEST(Followers, ASiteThatMakesUpProcessesLeavesRoomForOthers) {
  Followers followers(100);
  for (std::uint32_t i = 0; i < 1000; ++i) followers.heard("storm", i, 1000 + i, kSecond);
  EXPECT_EQ(followers.clients(), 50U);
  EXPECT_TRUE(followers.heard("edge", 1, 1, kSecond));
  // Five sites together leave some, too.
  for (const char* const site : {"a", "b", "c", "d"})
    for (std::uint32_t i = 0; i < 1000; ++i)
      followers.heard(site, i, (ClientId{i} << 8U) + static_cast<unsigned char>(*site), kSecond);
  EXPECT_TRUE(followers.heard("late", 1, 7, kSecond));
}

TEST(Followers, AClientThatMakesRoomIsReplacedAtOnce) {
  Followers followers(2);
  ASSERT_TRUE(followers.heard("edge", 1, 1, kSecond));
  EXPECT_FALSE(followers.heard("edge", 2, 2, kSecond));
  followers.left("edge", 1, 1);
  EXPECT_TRUE(followers.heard("edge", 2, 2, kSecond));
  EXPECT_EQ(followers.processes(), 1U);
}

TEST(Followers, WhereASiteHasNoPlaceLeftItsSilentClientsMakeRoom) {
  Followers followers(4);
  ASSERT_TRUE(followers.heard("other", 1, 9, kSecond));
  ASSERT_TRUE(followers.heard("edge", 1, 1, kSecond));
  EXPECT_FALSE(followers.heard("edge", 2, 2, kSecond) && followers.heard("edge", 3, 3, kSecond));
  EXPECT_TRUE(followers.heard("edge", 4, 4, kSecond + Followers::kSilentNs + 1));
  EXPECT_TRUE(followers.knows(participant("other", 1, 9))) << "it is another site's";
}

TEST(Followers, WhoIsSilentIsForgottenWithAllItsPlaces) {
  Followers followers(100);
  const auto heard = followers.heard("edge", 1, 1, 0);
  ASSERT_TRUE(heard);
  const ParticipantId from = heard->from;
  EXPECT_TRUE(followers.alive(from, Followers::kSilentNs - 1));
  EXPECT_FALSE(followers.alive(from, Followers::kSilentNs));
  followers.forget_silent(Followers::kForgottenNs);
  EXPECT_TRUE(followers.knows(from)) << "a link that was cut";
  EXPECT_EQ(followers.site_of(1), "edge");
  followers.forget_silent(Followers::kForgottenNs + 1);
  EXPECT_FALSE(followers.knows(from));
  EXPECT_EQ(followers.site_of(1), "");
  EXPECT_EQ(followers.sites() + followers.processes() + followers.clients(), 0U);
}

TEST(Followers, AnIdIsTheSitesThatUsedItFirstUntilThatLeaves) {
  Followers followers(100);
  ASSERT_TRUE(followers.heard("edge", 1, 7, 0));
  ASSERT_TRUE(followers.heard("storm", 1, 7, 0));
  EXPECT_EQ(followers.site_of(7), "edge");
  ASSERT_TRUE(followers.heard("edge", 2, 7, 0)) << "its process was started again";
  followers.left("edge", 1, 7);
  EXPECT_EQ(followers.site_of(7), "edge");
  followers.left("edge", 2, 7);
  ASSERT_TRUE(followers.heard("storm", 1, 7, 0));
  EXPECT_EQ(followers.site_of(7), "storm");
}

TEST(Followers, ASitePaysForAllItsProcessesAndAlsoAfterTheyLeft) {
  Followers followers(100);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const auto heard = followers.heard("storm", i, 1 + i, 0);
    ASSERT_TRUE(heard);
    heard->site_bytes->spend(Followers::kProcessBurst, 0);
    followers.left("storm", i, 1 + i);
    followers.forget_silent(0);
  }
  EXPECT_FALSE(followers.heard("storm", 9, 9, 0)->site_bytes->spend(0, 0));
  EXPECT_TRUE(followers.heard("edge", 9, 10, 0)->site_bytes->spend(0, 0));
}

TEST(Followers, NamesThatNobodyVouchesForAreBounded) {
  Followers followers(4096);
  for (std::uint32_t i = 0; i < 5000; ++i) followers.heard("made-up" + std::to_string(i), i, i + 1, 0);
  EXPECT_EQ(followers.sites(), Followers::kMaxSites);
}

// The vectors of the paper's appendix A, and of its reference implementation for nothing.
TEST(SiteProof, IsSipHash) {
  const Secret secret{0x0706050403020100U, 0x0f0e0d0c0b0a0908U};
  std::string text;
  EXPECT_EQ(site_proof(secret, text), 0x726fdb47dd0e0e31U);
  for (char c = 0; c < 15; ++c) text += c;
  EXPECT_EQ(site_proof(secret, text), 0xa129ca6149be45e5U);
}

}  // namespace
}  // namespace tandem::transport::nats
