// A relay that was restarted goes on from what it kept.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "services/follow/following/kept_state.hpp"
#include "tests/unit/relay/stage.hpp"

namespace tandem::relay {
namespace {

std::vector<transport::SnapshotMessage> states_of(Passing& relay) {
  std::vector<transport::SnapshotMessage> states;
  relay.upstream->each_feed([&](Feed& feed) {
    auto cut = feed.client().cut();
    ASSERT_TRUE(cut);
    transport::SnapshotMessage& state = states.emplace_back();
    state.epoch = feed.epoch();
    state.stream = cut->stream;
    state.frame = cut->frame;
    state.total_bytes = static_cast<std::uint32_t>(cut->bytes.size());
    state.bytes = std::move(cut->bytes);
  });
  return states;
}

client::Now moment_of(const Stage& stage) { return {stage.now_ns, stage.now_ns + 1'700'000'000 * kSecond}; }

struct Site {
  explicit Site(std::uint64_t seed) : stage(seed) {
    stage.start_server(1000, 2);
    stage.start_near();
    stage.start_far();
    near = &stage.add_near("thin");
    thin = &stage.add_far("thin", transport::Role::kObserver);
    rich = &stage.add_far("rich");
    stage.run_ms(5000);
  }
  [[nodiscard]] std::uint64_t snapshots() const { return stage.near->relay->host()->totals().snapshots; }
  Stage stage;
  Watcher *near = nullptr, *thin = nullptr, *rich = nullptr;
};

TEST(Resuming, ARelayThatIsRestartedGoesOnAndNobodyJoinsAnew) {
  Site site(11);
  Stage& stage = site.stage;
  ASSERT_TRUE(site.thin->plays() && site.rich->plays());
  auto kept = states_of(*stage.far);
  ASSERT_EQ(kept.size(), 2U);
  ASSERT_TRUE(site.near->core->send(transport::InputKind::kGravity, {1, -9, 0}, {}, moment_of(stage)));
  stage.run_ms(8000);
  stage.far.reset();
  ASSERT_TRUE(site.near->core->send(transport::InputKind::kGravity, {-1, -9, 0}, {}, moment_of(stage)));
  stage.run_ms(1500);
  const std::uint64_t before = site.snapshots();
  stage.start_far(std::move(kept));
  stage.run_ms(2000);
  EXPECT_GE(site.thin->frame() + 6, site.near->frame());
  EXPECT_GE(site.rich->frame() + 6, site.near->frame());
  stage.run_ms(6000);
  EXPECT_EQ(site.thin->resyncs() + site.rich->resyncs(), 0U);
  EXPECT_EQ(site.thin->core->join_attempt(), 1U);
  EXPECT_EQ(site.thin->core->statistics().epochs, 1U);
  EXPECT_EQ(site.snapshots(), before) << "the hub was asked for a snapshot";
  EXPECT_GE(site.rich->frame() + 6, site.near->frame());
  Stage::expect_same(*site.near, *site.thin, 600);
  // And it is served as before.
  ASSERT_TRUE(
      site.rich->core->send(transport::InputKind::kPush, {0, 0, 0, 1, 1, 0, 0}, {}, moment_of(stage)));
  stage.run_ms(500);
  ASSERT_EQ(site.rich->outcomes.size(), 1U);
  EXPECT_EQ(site.rich->outcomes[0].kind, client::InputOutcome::Kind::kActed);
}

// The client asks for a snapshot again before the deltas that it missed are there.
TEST(Resuming, OverALongLinkNoSnapshotIsAskedForEither) {
  Site site(16);
  Stage& stage = site.stage;
  stage.nats.delay_ns = 80 * kMillisecond;
  stage.run_ms(2000);
  auto kept = states_of(*stage.far);
  stage.run_ms(3000);
  stage.far.reset();
  stage.run_ms(1500);
  const std::uint64_t before = site.snapshots();
  stage.start_far(std::move(kept));
  stage.run_ms(6000);
  EXPECT_EQ(site.snapshots(), before) << "the hub was asked for a snapshot";
  EXPECT_EQ(site.thin->resyncs() + site.rich->resyncs(), 0U);
  EXPECT_GE(site.thin->frame() + 12, site.near->frame());
  EXPECT_GE(site.rich->frame() + 12, site.near->frame());
}

// The new relay publishes before the clients know that the other is dead.
TEST(Resuming, ARelayThatIsKilledAndStartedAtOnceGoesOnAsWell) {
  Site site(15);
  Stage& stage = site.stage;
  auto kept = states_of(*stage.far);
  stage.run_ms(3000);
  stage.kill_far();
  stage.start_far(std::move(kept));
  stage.run_ms(8000);
  EXPECT_EQ(site.thin->resyncs() + site.rich->resyncs(), 0U);
  EXPECT_EQ(site.thin->core->statistics().epochs, 1U);
  EXPECT_GE(site.thin->frame() + 6, site.near->frame());
  EXPECT_GE(site.rich->frame() + 6, site.near->frame());
  Stage::expect_same(*site.near, *site.thin, 400);
}

TEST(Resuming, WithoutAStateTheyJoinTheRestartedRelayAnew) {
  Site site(12);
  site.stage.far.reset();
  site.stage.run_ms(1500);
  site.stage.start_far();
  site.stage.run_ms(6000);
  EXPECT_EQ(site.thin->resyncs(), 1U);
  EXPECT_GE(site.thin->frame() + 6, site.near->frame());
}

TEST(Resuming, AStateThatIsTooOldOrWrongIsNotUsed) {
  for (const bool wrong : {false, true}) {
    Site site(13);
    auto kept = states_of(*site.stage.far);
    if (wrong) {
      for (auto& state : kept) state.bytes[state.bytes.size() / 2] ^= std::byte{1};
    }
    site.stage.far.reset();
    site.stage.run_ms(wrong ? 1500 : 35'000);
    site.stage.start_far(std::move(kept));
    site.stage.run_ms(8000);
    EXPECT_EQ(site.thin->core->statistics().hash_mismatches, 0U);
    EXPECT_GE(site.thin->frame() + 6, site.near->frame());
    EXPECT_GE(site.rich->frame() + 6, site.near->frame());
    Stage::expect_same(*site.near, *site.thin, 100);
  }
}

TEST(Resuming, WithASecondRelayAtTheSiteNobodyJoinsAnewEither) {
  Site site(14);
  Stage& stage = site.stage;
  stage.second = std::move(stage.far);
  stage.start_far();
  std::swap(stage.far, stage.second);
  stage.run_ms(4000);
  ASSERT_TRUE(stage.second->relay->stands_by());
  stage.far.reset();
  stage.run_ms(8000);
  EXPECT_FALSE(stage.second->relay->stands_by());
  EXPECT_EQ(site.thin->resyncs() + site.rich->resyncs(), 0U);
  EXPECT_EQ(site.thin->core->statistics().epochs, 1U);
  EXPECT_GE(site.thin->frame() + 6, site.near->frame());
  EXPECT_GE(site.rich->frame() + 6, site.near->frame());
  Stage::expect_same(*site.near, *site.thin, 400);
}

TEST(Resuming, TheFileIsWholeOrNotThere) {
  const auto path = std::filesystem::temp_directory_path() / "tandem_kept_state_test";
  using following::KeptState;
  const KeptState kept(path.string());
  std::filesystem::remove(path);
  EXPECT_TRUE(kept.read().empty());
  transport::SnapshotMessage state;
  state.epoch = 7;
  state.stream = {1, 0};
  state.frame = 40;
  state.total_bytes = 100;
  state.bytes.assign(100, std::byte{3});
  ASSERT_TRUE(kept.write({state, state}));
  EXPECT_EQ(kept.read(), (std::vector{state, state}));
  const auto size = std::filesystem::file_size(path);
  for (std::uintmax_t cut : {size - 1, size / 2 + 1, std::uintmax_t{3}}) {
    std::filesystem::resize_file(path, cut);
    EXPECT_TRUE(kept.read().empty()) << cut;
  }
  std::ofstream(path, std::ios::binary) << std::string(200, '\xFF');
  EXPECT_TRUE(kept.read().empty());
  std::filesystem::remove(path);
  EXPECT_EQ(KeptState("/nonexistent/x").write({state}).error().code, ErrorCode::kIo);
}

}  // namespace
}  // namespace tandem::relay
