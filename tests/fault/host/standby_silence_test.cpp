// A live server that hangs while DDS goes on, and servers that are only slow.
#include "tests/fault/host/relay.hpp"

#include <algorithm>

namespace tandem::host::relay {
namespace {

constexpr auto kLost = client::InputOutcome::Kind::kLost;
constexpr auto kActed = client::InputOutcome::Kind::kActed;

TEST(Silence, AServerThatHangsIsReplacedWithin3SecondsAndLeavesWhenItWakes) {
  for_seeds(10, [](std::uint64_t seed) {
    Dice dice(seed);
    Cast cast(seed);
    Server& live = cast.add_live();
    Server& other = cast.add_standby();
    for (int i = 0; i < 3; ++i) cast.add_client();
    cast.run_ms(3000 + static_cast<std::int64_t>(dice.below(1500)));
    ASSERT_TRUE(cast.all_play(live));
    const Frame last = live.host->frame();
    const Epoch epoch = live.host->session().epoch;
    Cast::hang(live, true);
    cast.run_ms(500);
    for (auto& client : cast.clients) cast.send(*client);
    cast.run_ms(2500);
    ASSERT_NE(other.host, nullptr);
    EXPECT_TRUE(cast.all_play(other)) << "3 s after the last frame";
    EXPECT_EQ(other.host->session().continues_epoch, epoch);
    EXPECT_EQ(other.host->session().continues_frame, last);
    for (auto& client : cast.clients) EXPECT_EQ(client->watcher.outcomes[1].kind, kLost);
    cast.run_ms(static_cast<std::int64_t>(dice.below(8000)));
    Cast::hang(live, false);
    cast.run_ms(1300);
    EXPECT_EQ(live.host, nullptr) << "nobody follows it";
    cast.run_ms(500);
    EXPECT_TRUE(cast.all_play(other));
    EXPECT_EQ(cast.mismatches(), 0U);
  });
}

TEST(Silence, AServerThatHangsWithoutClientsIsReplacedAndLeavesWhenItWakes) {
  Cast cast(1);
  Server& live = cast.add_live();
  Server& other = cast.add_standby();
  cast.run_ms(4000);
  Cast::hang(live, true);
  cast.run_ms(3000);
  ASSERT_NE(other.host, nullptr);
  cast.run_ms(10'000);
  EXPECT_NE(other.host, nullptr) << "an announcement alone ends nobody";
  Cast::hang(live, false);
  cast.run_ms(1500);
  EXPECT_EQ(live.host, nullptr);
  ASSERT_NE(other.host, nullptr);
  Member& client = cast.add_client();
  cast.run_ms(2000);
  EXPECT_TRUE(cast.all_play(other));
  EXPECT_EQ(client.core->session()->epoch, other.host->session().epoch);
}

TEST(Silence, WhoComesWhileAServerHangsJoinsTheOneThatTookOver) {
  Cast cast(2);
  Server& live = cast.add_live();
  Server& other = cast.add_standby();
  cast.run_ms(4000);
  Cast::hang(live, true);
  cast.run_ms(2500);
  ASSERT_NE(other.host, nullptr);
  cast.add_client();
  cast.run_ms(3000);
  EXPECT_TRUE(cast.all_play(other));
}

// However long it hangs: one world is left, and each input acted there once or its sender was told that it
// did not.
TEST(Silence, EveryInputActsOnceOrIsToldAsLost) {
  std::size_t replaced = 0, kept = 0, lost = 0;
  for_seeds(30, [&](std::uint64_t seed) {
    Dice dice(seed);
    Cast cast(seed);
    Server& live = cast.add_live();
    Server& other = cast.add_standby();
    for (int i = 0; i < 2; ++i) cast.add_client();
    cast.run_ms(2500);
    const auto play = [&](std::int64_t ms) {
      for (std::int64_t t = 0; t < ms; t += 20) {
        cast.run_ms(20);
        if (dice.one_in(4)) cast.send(*cast.clients[static_cast<std::size_t>(dice.below(2))]);
      }
    };
    play(1000 + static_cast<std::int64_t>(dice.below(1000)));
    Cast::hang(live, true);
    play(500 + static_cast<std::int64_t>(dice.below(3000)));
    Cast::hang(live, false);
    play(4000);
    cast.run_ms(2000);
    ASSERT_TRUE((live.host == nullptr) != (other.host == nullptr)) << "one world";
    Server& survivor = live.host ? live : other;
    ++(live.host ? kept : replaced);
    ASSERT_TRUE(cast.all_play(survivor));
    std::vector<std::pair<Frame, double>> history;
    const Frame from = live.host ? UINT64_MAX : other.host->session().continues_frame;
    for (const auto& [frame, value] : live.simulation->acted)
      if (frame <= from) history.emplace_back(frame, value);
    if (other.host) {
      for (const auto& [frame, value] : other.simulation->acted)
        if (frame > from) history.emplace_back(frame, value);
    }
    for (const auto& client : cast.clients) {
      for (const auto& [number, value] : client->sent) {
        const auto of_value = [&](const auto& entry) { return entry.second == value; };
        const auto acted = std::ranges::count_if(history, of_value);
        ASSERT_LE(acted, 1) << "input " << number;
        const auto told = client->watcher.outcomes.find(number);
        ASSERT_NE(told, client->watcher.outcomes.end()) << "nothing is known of input " << number;
        if (told->second.kind == client::InputOutcome::Kind::kUnknown) continue;
        ASSERT_EQ(acted, told->second.kind == kActed ? 1 : 0) << "input " << number;
        if (told->second.kind == kLost) ++lost;
      }
    }
    EXPECT_EQ(cast.mismatches(), 0U);
  });
  EXPECT_GT(replaced, 5U);
  EXPECT_GT(kept, 5U);
  EXPECT_GT(lost, 5U);
}

// A server that makes a frame in `frame_ms`: it does nothing else meanwhile.
void run_slow(Cast& cast, Server& server, std::int64_t frame_ms, std::int64_t ms) {
  for (std::int64_t t = 0; t < ms && server.host; t += frame_ms) {
    Cast::hang(server, true);
    cast.run_ms(frame_ms - 1);
    Cast::hang(server, false);
    cast.run_ms(1);
  }
}

TEST(Silence, AServerThatIsOnlySlowGoesOn) {
  for (const std::int64_t frame_ms : {170, 700, 1400}) {
    for (const bool alone : {true, false}) {
      Cast cast(3);
      Server& live = cast.add_live();
      Server& other = cast.add_standby();
      if (!alone) cast.add_client();
      run_slow(cast, live, frame_ms, 40 * frame_ms);
      ASSERT_GT(other.standby->holds(), 0U) << "it could take over";
      const Frame before = live.host->frame();
      run_slow(cast, live, frame_ms, 40 * frame_ms);
      ASSERT_NE(live.host, nullptr);
      EXPECT_GE(live.host->frame(), before + 25);
      EXPECT_EQ(other.host, nullptr) << frame_ms << " ms a frame";
    }
  }
}

TEST(Silence, AWorldThatWaitsForAParticipantGoesOn) {
  Cast cast(4);
  HostConfig patient;
  patient.stall_timeout_ns.reset();
  Server& live = cast.add_live(patient);
  Server& other = cast.add_standby();
  Member& client = cast.add_client();
  cast.run_ms(4000);
  ASSERT_GT(other.standby->holds(), 0U);
  client.waits = true;
  cast.run_ms(500);
  const Frame before = live.host->frame();
  cast.run_ms(10'000);
  EXPECT_EQ(live.host->frame(), before) << "it stands still";
  EXPECT_EQ(other.host, nullptr);
}

TEST(Silence, AServerThatStandsByAndPausedItselfTakesNothingOver) {
  Cast cast(5);
  Server& live = cast.add_live();
  Server& other = cast.add_standby();
  cast.run_ms(4000);
  Cast::hang(other, true);
  cast.run_ms(20'000);
  Cast::hang(other, false);
  cast.run_ms(3000);
  EXPECT_EQ(other.host, nullptr);
  EXPECT_NE(live.host, nullptr);
}

TEST(Silence, WhileAServerHandsOverTheOthersWait) {
  Cast cast(6);
  Server& live = cast.add_live();
  Server& first = cast.add_standby(1);
  Server& second = cast.add_standby(2);
  cast.add_client();
  cast.run_ms(4000);
  const Frame asked = live.host->frame();
  cast.hand_over(live);
  // It hangs when it has said that it is ready; the live server then makes its last frame.
  for (int i = 0; i < 2000 && first.standby->holds() <= asked + 3; ++i) cast.run_ms(1);
  ASSERT_NE(first.standby, nullptr);
  Cast::hang(first, true);
  cast.run_ms(500);
  ASSERT_NE(live.host, nullptr);
  const Frame last = live.host->frame();
  cast.run_ms(1000);
  EXPECT_EQ(live.host->frame(), last) << "it waits for the other one";
  cast.run_ms(7000);
  ASSERT_NE(live.host, nullptr);
  EXPECT_GT(live.host->frame(), last) << "it goes on";
  EXPECT_EQ(first.host, nullptr);
  EXPECT_EQ(second.host, nullptr);
}

TEST(Silence, WhereOnlyTheLinkToTheLiveServerIsBadItsClientsShowThatItWorks) {
  Cast cast(7);
  Server& live = cast.add_live();
  Server& other = cast.add_standby();
  cast.add_client();
  cast.run_ms(4000);
  ASSERT_GT(other.standby->holds(), 0U);
  transport::simulated::LinkModel thin;
  thin.bottleneck = std::make_shared<transport::simulated::Bottleneck>(
      transport::simulated::BottleneckOptions{.bits_per_s = 100});
  cast.network.set_link(live.port->self(), other.port->self(), thin);
  cast.run_ms(20'000);
  EXPECT_EQ(other.host, nullptr);
  EXPECT_TRUE(cast.all_play(live));
}

}  // namespace
}  // namespace tandem::host::relay
