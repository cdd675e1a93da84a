// A live server, servers that stand by for it, and clients, on a simulated network.
#include "tests/fault/host/relay.hpp"

#include <optional>
#include <set>

namespace tandem::host::relay {
namespace {

TEST(Standby, ATakeoverNeverHasTheEpochOfAStartOrOfAnotherRank) {
  Cast cast(1);
  std::vector<std::set<Epoch>> begun(8);
  for (std::int64_t wall_ms = 1'700'000'000'000; wall_ms < 1'700'000'000'100; ++wall_ms) {
    HostConfig config;
    config.epoch = static_cast<Epoch>(wall_ms);
    begin_from({}, config);
    EXPECT_LE(config.epoch, static_cast<Epoch>(wall_ms));
    begun[0].insert(config.epoch);
  }
  for (std::uint32_t rank = 1; rank < begun.size(); ++rank) {
    const Server& server = cast.add_standby(rank);
    for (std::int64_t wall_ms = 1'699'999'999'000; wall_ms < 1'700'000'000'100; ++wall_ms) {
      begun[rank].insert(server.standby->epoch_at(wall_ms));
      EXPECT_GT(server.standby->epoch_at(wall_ms), static_cast<Epoch>(wall_ms));
    }
  }
  std::set<Epoch> all;
  for (const std::set<Epoch>& by : begun)
    for (const Epoch epoch : by) EXPECT_TRUE(all.insert(epoch).second) << epoch << " is begun by two";
}

TEST(Standby, WhenTheServerDiesNoFrameIsLostAndClientsPlayOnWithin3Seconds) {
  for_seeds(15, [](std::uint64_t seed) {
    Dice dice(seed);
    Cast cast(seed);
    Server& live = cast.add_live();
    Server& other = cast.add_standby();
    for (int i = 0; i < 3; ++i) cast.add_client();
    cast.run_ms(3000 + static_cast<std::int64_t>(dice.below(1500)));
    ASSERT_TRUE(cast.all_play(live));
    const Frame last = live.host->frame();
    const Epoch epoch = live.host->session().epoch;
    const auto positions = live.simulation->positions;
    cast.kill(live);
    cast.run_ms(1500);
    ASSERT_NE(other.host, nullptr);
    EXPECT_EQ(other.why_not, "");
    EXPECT_EQ(other.host->session().continues_epoch, epoch);
    EXPECT_EQ(other.host->session().continues_frame, last);
    for (const auto& [frame, bodies] : other.simulation->positions) {
      const auto before = positions.find(frame);
      if (before != positions.end()) {
        ASSERT_EQ(bodies, before->second) << "frame " << frame << " of the same world";
      }
    }
    cast.run_ms(1500);
    EXPECT_TRUE(cast.all_play(other));
    EXPECT_EQ(cast.mismatches(), 0U);
  });
}

TEST(Standby, WhoAnnouncesTheEpochOfAServerThatDiedDoesNotTakeItsPlace) {
  for_seeds(8, [](std::uint64_t seed) {
    Cast cast(seed);
    Server& live = cast.add_live();
    Server& other = cast.add_standby();
    for (int i = 0; i < 3; ++i) cast.add_client();
    cast.run_ms(4000);
    const auto imitator = must(cast.network.make_server("default"));
    cast.must_do(imitator->write(live.host->session()));
    cast.run_ms(1000);
    const Epoch epoch = live.host->session().epoch;
    const Frame last = live.host->frame();
    cast.kill(live);
    cast.run_ms(1500);
    ASSERT_NE(other.host, nullptr) << "it took over, and stays";
    EXPECT_EQ(other.host->session().continues_epoch, epoch);
    EXPECT_EQ(other.host->session().continues_frame, last);
    cast.run_ms(8000);
    ASSERT_NE(other.host, nullptr);
    EXPECT_TRUE(cast.all_play(other));
  });
}

// As a service without a folder for checkpoints is.
TEST(Standby, AServerThatIsStartedAgainAtOnceBeginsNoNewWorld) {
  for_seeds(10, [](std::uint64_t seed) {
    Dice dice(seed);
    Cast cast(seed);
    Server& live = cast.add_live();
    Server& other = cast.add_standby();
    cast.add_client();
    cast.run_ms(3000 + static_cast<std::int64_t>(dice.below(1500)));
    const Frame last = live.host->frame();
    cast.kill(live);
    cast.run_ms(static_cast<std::int64_t>(dice.below(1000)));
    const Server& again = cast.add_live();
    cast.run_ms(3000);
    ASSERT_NE(other.host, nullptr);
    EXPECT_EQ(other.host->session().continues_frame, last);
    EXPECT_EQ(again.host, nullptr) << "it sees who is live, and ends";
    EXPECT_TRUE(cast.all_play(other));
  });
}

TEST(Standby, EveryInputActsOnceOrIsToldAsLost) {
  std::size_t acted_before = 0, lost = 0;
  for_seeds(25, [&](std::uint64_t seed) {
    Dice dice(seed);
    Cast cast(seed);
    Server& live = cast.add_live();
    Server& other = cast.add_standby();
    for (int i = 0; i < 2; ++i) cast.add_client();
    cast.run_ms(2500);
    const auto play = [&](std::int64_t ms) {
      for (std::int64_t t = 0; t < ms; t += 20) {
        cast.run_ms(20);
        if (dice.one_in(3)) cast.send(*cast.clients[static_cast<std::size_t>(dice.below(2))]);
      }
    };
    play(1500 + static_cast<std::int64_t>(dice.below(1000)));
    const auto before = live.simulation->acted;
    cast.kill(live);
    play(4000);
    ASSERT_NE(other.host, nullptr);
    ASSERT_TRUE(cast.all_play(other));
    cast.run_ms(1000);
    auto history = before;
    const Frame from = other.host->session().continues_frame;
    for (const auto& [frame, value] : other.simulation->acted)
      if (frame > from) history.emplace_back(frame, value);
    acted_before += before.size();
    for (const auto& client : cast.clients) {
      for (const auto& [number, value] : client->sent) {
        const auto of_value = [&](const auto& entry) { return entry.second == value; };
        const auto acted = std::ranges::count_if(history, of_value);
        ASSERT_LE(acted, 1) << "input " << number;
        const auto told = client->watcher.outcomes.find(number);
        ASSERT_NE(told, client->watcher.outcomes.end()) << "nothing is known of input " << number;
        const bool says_acted = told->second.kind == client::InputOutcome::Kind::kActed;
        ASSERT_EQ(acted, says_acted ? 1 : 0) << "input " << number;
        if (says_acted) {
          ASSERT_EQ(std::ranges::find_if(history, of_value)->first, told->second.frame);
        }
        if (told->second.kind == client::InputOutcome::Kind::kLost) ++lost;
      }
    }
  });
  EXPECT_GT(acted_before, 100U);
  EXPECT_GT(lost, 0U) << "sent while there was no server";
}

TEST(Standby, AnEngineThatGoesAnotherWayIsContinuedFromItsCheckpoint) {
  Cast cast(3);
  Server& live = cast.add_live();
  Server& other = cast.add_standby(1, true);
  cast.add_client();
  cast.run_ms(4000);
  const Frame last = live.host->frame();
  cast.kill(live);
  cast.run_ms(3000);
  ASSERT_NE(other.host, nullptr);
  EXPECT_NE(other.why_not, "");
  EXPECT_LT(other.host->session().continues_frame, last);
  EXPECT_LE(last - other.host->session().continues_frame, 32U) << "a second, and the time to send it";
  EXPECT_TRUE(cast.all_play(other));
  EXPECT_EQ(cast.mismatches(), 0U);
}

TEST(Standby, TheLowestRankTakesOverAndTheOthersFollowIt) {
  Cast cast(4);
  Server& live = cast.add_live();
  Server& second = cast.add_standby(2);
  Server& first = cast.add_standby(1);
  cast.add_client();
  cast.run_ms(4000);
  cast.kill(live);
  cast.run_ms(4000);
  ASSERT_NE(first.host, nullptr);
  ASSERT_EQ(second.host, nullptr);
  ASSERT_TRUE(cast.all_play(first));
  EXPECT_EQ(second.standby->follows(), first.host->session().epoch);
  const Frame last = first.host->frame();
  cast.kill(first);
  cast.run_ms(3000);
  ASSERT_NE(second.host, nullptr);
  EXPECT_EQ(second.host->session().continues_frame, last);
  EXPECT_TRUE(cast.all_play(second));
}

TEST(Standby, WhereTheFirstInRankFailsTooTheNextTakesOver) {
  Cast cast(5);
  Server& live = cast.add_live();
  Server& first = cast.add_standby(1);
  Server& second = cast.add_standby(2);
  cast.add_client();
  cast.run_ms(4000);
  cast.freeze(first, true);
  cast.kill(live);
  cast.run_ms(3000);
  ASSERT_NE(second.host, nullptr) << "the frozen one is not waited for";
  cast.run_ms(500);
  EXPECT_TRUE(cast.all_play(second));
  cast.freeze(first, false);
  cast.run_ms(3000);
  EXPECT_EQ(first.host, nullptr) << "it sees that there is a live server";
  EXPECT_TRUE(cast.all_play(second));
}

TEST(Standby, AHandoverLosesNoFrameAndPausesForLessThanHalfASecond) {
  for_seeds(10, [](std::uint64_t seed) {
    Dice dice(seed);
    Cast cast(seed);
    Server& live = cast.add_live();
    Server& other = cast.add_standby();
    for (int i = 0; i < 3; ++i) cast.add_client();
    cast.run_ms(3000 + static_cast<std::int64_t>(dice.below(1000)));
    const Epoch epoch = live.host->session().epoch;
    cast.hand_over(live);
    Frame last = 0;
    for (int i = 0; i < 2000 && live.host; ++i) {
      last = live.host->frame();
      cast.run_ms(1);
    }
    ASSERT_EQ(live.host, nullptr) << "it did not leave";
    ASSERT_NE(other.host, nullptr);
    EXPECT_EQ(other.host->session().continues_epoch, epoch);
    EXPECT_EQ(other.host->session().continues_frame, last);
    cast.run_ms(500);
    EXPECT_TRUE(cast.all_play(other));
    EXPECT_EQ(cast.mismatches(), 0U);
  });
}

TEST(Standby, AHandoverGoesToTheFirstAndTheOthersStandByForIt) {
  for (const std::uint32_t rank_of_other : {1U, 2U}) {
    Cast cast(9);
    Server* live = &cast.add_live();
    cast.add_standby(rank_of_other);
    cast.add_standby(1);
    cast.add_client();
    cast.run_ms(4000);
    const auto count = [&](auto&& has) {
      return std::ranges::count_if(cast.servers, [&](const auto& server) { return has(*server); });
    };
    for (int times = 0; times < 2; ++times) {
      const Frame before = live->host->frame();
      cast.hand_over(*live);
      cast.run_ms(4000);
      ASSERT_EQ(live->host, nullptr);
      ASSERT_EQ(count([](const Server& server) { return server.host != nullptr; }), 1);
      ASSERT_EQ(count([](const Server& server) { return server.standby != nullptr; }), 1 - times);
      for (const auto& server : cast.servers)
        if (server->host) live = server.get();
      EXPECT_GT(live->host->frame(), before + 90);
      EXPECT_TRUE(cast.all_play(*live));
    }
  }
}

TEST(Standby, AHandoverLosesNoFrameWhereTheEngineGoesAnotherWay) {
  Cast cast(10);
  Server& live = cast.add_live();
  Server& other = cast.add_standby(1, true);
  cast.add_client();
  cast.run_ms(4100);
  cast.hand_over(live);
  Frame last = 0;
  for (int i = 0; i < 3000 && live.host; ++i) {
    last = live.host->frame();
    cast.run_ms(1);
  }
  ASSERT_EQ(live.host, nullptr);
  ASSERT_NE(other.host, nullptr);
  EXPECT_EQ(other.host->session().continues_frame, last);
}

TEST(Standby, AHandoverToAServerThatPausesAWhileIsMade) {
  Cast cast(11);
  Server& live = cast.add_live();
  Server& other = cast.add_standby();
  cast.add_client();
  cast.run_ms(4000);
  cast.hand_over(live);
  cast.run_ms(90);
  other.frozen = true;  // not polled, but DDS goes on
  cast.run_ms(600);
  other.frozen = false;
  cast.run_ms(1500);
  EXPECT_EQ(live.host, nullptr);
  ASSERT_NE(other.host, nullptr);
  EXPECT_TRUE(cast.all_play(other));
}

// The other one followed the new server, and has nothing of it yet.
TEST(Standby, IfTheNewServerDiesTooTheWorldBeforeIsHeld) {
  Cast cast(12);
  Server& live = cast.add_live();
  Server& first = cast.add_standby(1);
  Server& second = cast.add_standby(2);
  cast.add_client();
  cast.run_ms(4000);
  const Frame last = live.host->frame();
  cast.kill(live);
  for (int i = 0; i < 3000 && !first.host; ++i) cast.run_ms(1);
  ASSERT_NE(first.host, nullptr);
  cast.run_ms(30);
  cast.kill(first);
  cast.run_ms(6000);
  ASSERT_NE(second.host, nullptr);
  EXPECT_GE(second.host->session().continues_frame, last);
  EXPECT_TRUE(cast.all_play(second));
}

TEST(Standby, InputsThatCameDuringAHandoverThatFailedAreDecided) {
  int stood_still = 0;
  for (std::int64_t after_ms = 5; after_ms < 150; after_ms += 3) {
    Cast cast(13);
    Server& live = cast.add_live();
    Server& other = cast.add_standby();
    Member& client = cast.add_client();
    cast.run_ms(4000);
    cast.hand_over(live);
    cast.run_ms(after_ms);
    if (other.host) break;  // from here on the handover is made
    cast.kill(other);
    const Frame before = live.host->frame();
    for (int i = 0; i < 5; ++i) {
      cast.send(client);
      cast.run_ms(50);
    }
    if (live.host->frame() < before + 3) ++stood_still;
    cast.run_ms(16'000);
    ASSERT_NE(live.host, nullptr);
    ASSERT_EQ(client.sent.size(), 5U);
    EXPECT_EQ(client.watcher.outcomes.size(), 5U) << "killed after " << after_ms << " ms";
  }
  EXPECT_GT(stood_still, 0);
}

TEST(Standby, OfTwoServersWithoutClientsTheOneThatWentOnElsewhereLeaves) {
  Cast cast(14);
  Server& live = cast.add_live();
  Server& other = cast.add_standby();
  cast.run_ms(4000);
  cast.freeze(live, true);
  cast.run_ms(4000);
  ASSERT_NE(other.host, nullptr);
  cast.freeze(live, false);
  cast.run_ms(4000);
  EXPECT_EQ(live.host, nullptr);
  EXPECT_NE(other.host, nullptr);
}

TEST(Standby, AHandoverWithoutAnybodyReadyChangesNothing) {
  Cast cast(6);
  Server& live = cast.add_live();
  cast.add_client();
  cast.run_ms(2000);
  cast.hand_over(live);
  const Frame before = live.host->frame();
  cast.run_ms(2000);
  ASSERT_NE(live.host, nullptr);
  EXPECT_GT(live.host->frame(), before + 50);
}

TEST(Standby, AHandoverToAServerThatDiesGoesOnHere) {
  Cast cast(7);
  Server& live = cast.add_live();
  Server& other = cast.add_standby();
  cast.add_client();
  cast.run_ms(3500);
  cast.hand_over(live);
  cast.run_ms(20);
  cast.kill(other);
  cast.run_ms(14'000);
  ASSERT_NE(live.host, nullptr);
  const Frame before = live.host->frame();
  cast.run_ms(1000);
  EXPECT_GE(live.host->frame(), before + 25) << "frames are made again";
  EXPECT_TRUE(cast.all_play(live));
}

// Both sides of a cut go on; when it heals, the world with more clients survives, and those of the other are
// told which of their inputs are lost.
void heal_a_partition(std::uint64_t seed, bool majority_stays) {
  Cast cast(seed);
  Server& live = cast.add_live();
  Server& other = cast.add_standby();
  Member& here = cast.add_client();
  Member& there = cast.add_client();
  Member& third = cast.add_client();
  cast.run_ms(3500);
  ASSERT_TRUE(cast.all_play(live));
  const auto cut = [&, live_id = live.port->self(), other_id = other.port->self()](bool is_cut) {
    std::vector<transport::ParticipantId> left{live_id, here.port->self()};
    std::vector<transport::ParticipantId> right{other_id, there.port->self()};
    (majority_stays ? left : right).push_back(third.port->self());
    for (const auto& a : left)
      for (const auto& b : right) cast.network.set_cut(a, b, is_cut);
  };
  cut(true);
  cast.run_ms(4000);
  ASSERT_NE(other.host, nullptr);
  for (Member* client : {&here, &there}) cast.send(*client);
  cast.run_ms(1000);
  for (Member* client : {&here, &there})
    ASSERT_EQ(client->watcher.outcomes.rbegin()->second.kind, client::InputOutcome::Kind::kActed);
  cut(false);
  cast.run_ms(4000);
  Server& survivor = majority_stays ? live : other;
  ASSERT_NE(survivor.host, nullptr);
  EXPECT_EQ((majority_stays ? other : live).host, nullptr) << "it has fewer followers";
  EXPECT_TRUE(cast.all_play(survivor));
  EXPECT_EQ(here.watcher.lost.size(), majority_stays ? 0U : 1U);
  EXPECT_EQ(there.watcher.lost.size(), majority_stays ? 1U : 0U);
  EXPECT_EQ(cast.mismatches(), 0U);
}

TEST(Standby, WhenAPartitionHealsTheWorldWithMoreClientsSurvives) {
  for_seeds(10, [](std::uint64_t seed) { heal_a_partition(seed, false); });
  for_seeds(10, [](std::uint64_t seed) { heal_a_partition(seed, true); });
}

TEST(Standby, AStrangersCheckpointsAndJournalAreNotTaken) {
  Cast cast(8);
  Server& live = cast.add_live();
  Server& other = cast.add_standby();
  cast.run_ms(2500);
  const auto stranger = must(cast.network.make_server("default"));
  Cast::must_do(stranger->open_standby(501 + 1));
  cast.run_ms(200);
  transport::CheckpointMessage part;
  part.epoch = live.host->session().epoch;
  part.frame = live.host->frame() + 1'000;
  part.total_bytes = 3;
  part.bytes.resize(3);
  Cast::must_do(stranger->write(501 + 1, part));
  transport::JournalMessage entry;
  entry.epoch = part.epoch;
  entry.number = 1'000'000;
  entry.frame = part.frame;
  entry.state = transport::JournalState::kLast;
  Cast::must_do(stranger->write(entry));
  cast.run_ms(500);
  EXPECT_EQ(other.host, nullptr) << "nobody handed over";
  const Frame last = live.host->frame();
  cast.kill(live);
  cast.run_ms(2000);
  ASSERT_NE(other.host, nullptr);
  EXPECT_EQ(other.host->session().continues_frame, last);
}

TEST(Standby, OneThatFallsBehindSaysSoAndTheWorldGoesOn) {
  Cast cast(15);
  Server& live = cast.add_live();
  Server& other = cast.add_standby();
  cast.add_client();
  cast.run_ms(3000);
  static_cast<void>(other.standby->take_notices());
  transport::simulated::LinkModel thin;
  thin.bottleneck = std::make_shared<transport::simulated::Bottleneck>(
      transport::simulated::BottleneckOptions{.bits_per_s = 1'000});
  cast.network.set_link(live.port->self(), other.port->self(), thin);
  const Frame before = live.host->frame();
  cast.run_ms(25'000);
  const auto lines = other.standby->take_notices();
  const auto falls_behind = [](const auto& notice) {
    return notice.warning && notice.text.starts_with("falls behind");
  };
  EXPECT_TRUE(std::ranges::any_of(lines, falls_behind));
  EXPECT_LE(lines.size(), 3U);
  EXPECT_GE(live.host->frame(), before + 740) << "the live server does not wait for it";
}

TEST(Standby, OverALossyLinkTheWorldIsAtMostASecondOlder) {
  for_seeds(10, [](std::uint64_t seed) {
    Cast cast(seed, {.delay_ns = 20'000'000, .jitter_ns = 10'000'000, .loss = 0.05});
    Server& live = cast.add_live();
    Server& other = cast.add_standby();
    cast.add_client();
    cast.run_ms(6000);
    const Frame last = live.host->frame();
    cast.kill(live);
    cast.run_ms(3500);
    ASSERT_NE(other.host, nullptr);
    EXPECT_LE(last - std::min(last, other.host->session().continues_frame), 30U);
    EXPECT_TRUE(cast.all_play(other));
    EXPECT_EQ(cast.mismatches(), 0U);
  });
}

}  // namespace
}  // namespace tandem::host::relay
