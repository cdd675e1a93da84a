// Tests the messages that leave the host, and what happens when they cannot.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/wire/cdr.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Publish, TheFirstDeltaIsFrameOneAndEveryFrameFollows) {
  Bench bench;
  bench.poll();
  bench.run_to(50);
  ASSERT_EQ(bench.port.deltas.size(), 50U);
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_EQ(bench.port.deltas[i].frame, i + 1);
    EXPECT_EQ(bench.port.deltas[i].parts, 1U);
    EXPECT_EQ(bench.port.deltas[i].epoch, test_config().epoch);
    EXPECT_EQ(bench.port.deltas[i].last_input, 0U);
  }
  EXPECT_EQ(bench.port.deltas.back().server_time_ns, Bench::kWallStart + bench.now);
}

// At rest for so long that not even ages change any more.
constexpr Frame kAtRest = 300;

TEST(Publish, AWorldAtRestSendsOneDeltaASecond) {
  Bench bench;
  bench.simulation.rests = true;
  bench.poll();
  bench.run_to(kAtRest);
  bench.port.deltas.clear();
  bench.run_to(kAtRest + 300);  // ten seconds
  ASSERT_GE(bench.port.deltas.size(), 9U);
  EXPECT_LE(bench.port.deltas.size(), 10U);
  for (std::size_t i = 1; i < bench.port.deltas.size(); ++i) {
    const transport::DeltaMessage& delta = bench.port.deltas[i];
    EXPECT_EQ(delta.frame - delta.earlier, bench.port.deltas[i - 1].frame + 1) << "no frame is left out";
    EXPECT_EQ(delta.hash, bench.host->hash());
    EXPECT_TRUE(delta.payload.empty());
  }
}

TEST(Publish, WhatMovesAtLastIsToldAtOnce) {
  Bench bench;
  bench.simulation.rests = true;
  bench.poll();
  bench.run_to(kAtRest + 10);
  bench.simulation.position[0][2] += 1;
  bench.port.deltas.clear();
  bench.run_to(kAtRest + 11);
  ASSERT_EQ(bench.port.deltas.size(), 1U) << "the quiet frames, and what ended them";
  EXPECT_EQ(bench.port.deltas[0].frame, kAtRest + 11);
  EXPECT_GE(bench.port.deltas[0].earlier, 1U);
  EXPECT_FALSE(bench.port.deltas[0].payload.empty());
}

TEST(Publish, AnEndTellsQuietFrames) {
  Bench bench;
  bench.simulation.rests = true;
  bench.poll();
  bench.run_to(kAtRest + 10);
  bench.host->tell_collected_frames();
  bench.drained();
  EXPECT_EQ(bench.port.deltas.back().frame, bench.host->frame());
}

TEST(Publish, AWallClockThatIsSetMovesNoStamp) {
  Bench bench;
  bench.poll();
  bench.run_to(10);
  for (const std::int64_t hours : {1, -1, 480'000}) {
    bench.wall_set_ns = hours * 3600 * kSecond;
    bench.run_to(bench.host->frame() + 10);
    EXPECT_EQ(bench.port.deltas.back().server_time_ns, Bench::kWallStart + bench.now) << hours;
  }
}

TEST(Publish, DeltasCarryTheHashOfTheAgreedState) {
  Bench bench;
  bench.simulation.on_step = [&](std::uint64_t step) {
    bench.simulation.position[0][2] = static_cast<float>(step);
  };
  bench.poll();
  bench.run_to(20);
  EXPECT_EQ(bench.port.deltas.back().hash, StateHasher().hash(bench.host->agreed()));
  EXPECT_EQ(bench.port.deltas.back().hash, bench.host->hash());
  EXPECT_EQ(bench.host->report().deltas.at(0).hash, bench.host->hash());
  EXPECT_EQ(bench.host->report().deltas.at(0).corrected, 1U);
}

TEST(Publish, AnEngineThatExplodesIsSaidOnceASecond) {
  Bench bench;
  bench.simulation.on_step = [&](std::uint64_t step) {
    if (step <= 40) ++bench.simulation.mishaps_so_far.removed;
  };
  bench.poll();
  bench.run_to(100);
  const std::vector<std::string> notices = bench.host->take_warnings();
  const auto said = [&](const char* text) {
    return std::ranges::count_if(notices, [&](const auto& line) { return line.find(text) != line.npos; });
  };
  EXPECT_EQ(said("faulty bodies"), 3) << "the first, then after one second, then the rest";
  EXPECT_EQ(said("40 removed"), 1);
}

TEST(Publish, BodiesThatAreNoneAnyMoreAreTakenOffAndSaidAndTheSessionGoesOn) {
  Bench bench(turning_config());
  FakeSimulation& engine = bench.simulation;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  engine.on_step = [&](std::uint64_t step) {
    if (step == 2) engine.orientation[3][0] = 0;  // of norm 0
    if (step == 3) engine.position[1][1] = nan;
    if (step == 4) engine.angular_velocity[2][2] = 1e9F;
    engine.position[0][3] = static_cast<float>(step);
  };
  bench.poll();
  bench.enter(7);
  bench.run_to(100);
  EXPECT_EQ(bench.host->agreed().alive_count(), 2U);
  EXPECT_NE(bench.host->agreed().body(3).p[0], 0);
  EXPECT_EQ(bench.port.deltas.back().hash, bench.host->hash());
  EXPECT_EQ(bench.host->totals().hidden, 2U);
  EXPECT_THAT(
      bench.host->take_warnings(),
      Contains(HasSubstr("1 of 4 bodies are not shown to clients until they are whole and within the extent "
                         "again; the last: slot 0 (its orientation has norm 0) in frame 2;")));
}

TEST(Publish, WhatIsHiddenIsSaidOnceInTenSecondsUnlessItIsMuchMore) {
  Bench bench;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto set = [&](std::initializer_list<float> places) {
    std::ranges::copy(places, bench.simulation.position[0].begin());
    bench.run_ms(100);
    return bench.host->take_warnings();
  };
  bench.poll();
  EXPECT_THAT(set({0, 0, 0, 0}), IsEmpty());
  EXPECT_THAT(set({0, nan, 0, 0}), ElementsAre(HasSubstr("1 of 4 bodies are not shown")));
  EXPECT_THAT(set({0, 0, 0, 0}), IsEmpty());
  EXPECT_THAT(set({0, nan, nan, 0}), IsEmpty());
  EXPECT_THAT(set({nan, nan, nan, nan}), ElementsAre(HasSubstr("4 of 4 bodies are not shown")));
  EXPECT_EQ(bench.host->totals().hidden, 4U);
  EXPECT_THAT(set({0, 0, 0, 0}), IsEmpty());
  EXPECT_EQ(bench.host->totals().hidden, 0U);
  EXPECT_EQ(bench.host->agreed().alive_count(), 4U);
  bench.run_ms(10'000);
  EXPECT_THAT(bench.host->take_warnings(), ElementsAre("all bodies are shown to clients again"));
  bench.run_ms(20'000);
  EXPECT_THAT(bench.host->take_warnings(), IsEmpty());
}

TEST(Publish, BodiesAtPlacesOfAMapHearOfAnOrigin) {
  Bench bench;
  const auto place = [&](float scatter) {
    for (std::size_t i = 0; i < 4; ++i) {
      bench.simulation.position[0][i] = 500'000 + scatter * static_cast<float>(i);
      bench.simulation.position[1][i] = 4'649'776;
    }
    EXPECT_THAT(bench.simulation.position[2], Each(0));
  };
  place(2);
  bench.poll();
  bench.run_ms(100);
  EXPECT_THAT(bench.host->take_warnings(),
              ElementsAre(AllOf(HasSubstr("4 of 4 bodies"),
                                HasSubstr("all are around (500003, 4649776, 0): subtract"))));
}

TEST(Publish, ASimulationWhoseColumnsShrinkEndsTheSessionAndIsNamed) {
  using Change = std::function<void(FakeSimulation&)>;
  const std::pair<Change, const char*> changes[] = {
      {[](auto& s) { s.position[0].resize(1); }, "column position[0] has 1 slots, not 4"},
      {[](auto& s) { std::vector<float>().swap(s.velocity[2]); }, "column velocity[2] has 0 slots, not 4"},
      {[](auto& s) { s.alive.resize(3); }, "column alive has 3 slots, not 4"},
      {[](auto& s) { s.type.resize(5); }, "column type has 5 slots, not 4"},
      {[](auto& s) { s.orientation[3].clear(); }, "column orientation[3] has 0 slots, not 4"},
      {[](auto& s) { s.angular_velocity[1].resize(2); }, "column angular_velocity[1] has 2 slots, not 4"}};
  for (const auto& [change, named] : changes) {
    Bench bench(turning_config());
    bench.simulation.on_step = [&, &changed = change](std::uint64_t step) {
      if (step == 5) changed(bench.simulation);
    };
    for (int i = 0; i < 20; ++i) {
      bench.poll();
      bench.now += Bench::kPeriod;
    }
    EXPECT_EQ(bench.host->state(), Host::State::kEnded);
    ASSERT_TRUE(bench.host->error().has_value());
    EXPECT_EQ(bench.host->error()->code, ErrorCode::kInvalidArgument);
    EXPECT_NE(bench.host->error()->message.find(named), std::string::npos) << bench.host->error()->message;
    EXPECT_EQ(bench.port.deltas.size(), 4U);
    EXPECT_EQ(bench.simulation.steps, 5U);
  }
}

TEST(Publish, FramesContinueFromAStartFrame) {
  HostConfig config = test_config();
  config.start_frame = 1000;
  Bench bench(config);
  bench.poll();
  bench.run_to(1001);
  EXPECT_EQ(bench.port.deltas.front().frame, 1001U);
}

TEST(Publish, LargeDeltasAreCutIntoPartsOfSixtyThousandBytes) {
  HostConfig config = test_config();
  config.streams[0].layout.codec = "none";
  Bench bench(config, 10'000);
  bench.poll();
  bench.run_to(2);
  const std::size_t size = bench.host->report().deltas.at(0).payload_bytes;
  ASSERT_GT(size, 240'000U);
  const auto parts = static_cast<std::uint32_t>((size + 59'999) / 60'000);
  ASSERT_EQ(bench.port.deltas.size(), 2U * parts);
  std::size_t sum = 0;
  for (std::uint32_t i = 0; i < parts; ++i) {
    const auto& delta = bench.port.deltas[parts + i];
    EXPECT_EQ(delta.frame, 2U);
    EXPECT_EQ(delta.part, i);
    EXPECT_EQ(delta.parts, parts);
    EXPECT_LE(delta.payload.size(), 60'000U);
    EXPECT_EQ(delta.hash, bench.host->hash());
    sum += delta.payload.size();
  }
  EXPECT_EQ(sum, size);
  EXPECT_LE(size, bench.host->session().streams[0].max_delta_bytes);
}

TEST(Publish, AFullQueueSuspendsTheServerAndNoDeltaIsDropped) {
  Bench bench;
  bench.poll();
  bench.draining = false;
  bench.run_ms(5000);
  const Frame held = bench.host->frame();
  EXPECT_EQ(held, 1 + test_config().outbox.frames);
  EXPECT_EQ(bench.simulation.steps, held);
  bench.draining = true;
  bench.run_ms(1000);
  EXPECT_NEAR(static_cast<double>(bench.host->frame() - held), 30, 1) << "and there is no catch-up";
  for (std::size_t i = 0; i < bench.port.deltas.size(); ++i) ASSERT_EQ(bench.port.deltas[i].frame, i + 1);
}

TEST(Publish, EveryQueueStaysBoundedWhenNothingIsWritten) {
  HostConfig config = test_config();
  config.outbox = {.frames = 4, .snapshots = 2, .control = 50};
  Bench bench(config);
  bench.poll();
  bench.enter(1);
  bench.draining = false;
  bench.on_ms = [&] { bench.playing(1, bench.host->frame()); };
  for (std::uint64_t i = 1; i < 3000; ++i) {
    bench.send(bench.gravity(1, i));
    bench.joining(2, static_cast<std::uint32_t>(i));
    bench.run_ms(10);
  }
  EXPECT_LE(bench.host->outbox().size(), 4 * 2 + 2 + 50U) << "a delta and its end a frame";
  EXPECT_GT(bench.host->totals().refused_inputs, 0U);
}

TEST(Publish, StatusGoesOutOnceASecondWithReadableFigures) {
  Bench bench;
  bench.simulation.on_step = [&](std::uint64_t) { bench.simulation.position[0][0] += 1; };
  bench.poll();
  bench.enter(1);
  bench.enter(2, transport::Role::kObserver);
  bench.on_ms = [&] { bench.playing(1, bench.host->frame()); };
  bench.port.statuses.clear();
  bench.run_ms(10'000);
  ASSERT_EQ(bench.port.statuses.size(), 10U);
  const auto& status = bench.port.statuses.back();
  EXPECT_EQ(status.session, "unit");
  EXPECT_EQ(status.bodies, 4U);
  EXPECT_EQ(status.participants, 1U);
  EXPECT_EQ(status.observers, 1U);
  EXPECT_EQ(status.window, 2U);
  EXPECT_NEAR(status.frame_rate_hz, 30, 1);
  EXPECT_NEAR(status.corrected_per_frame, 1, 1e-9);
  EXPECT_NEAR(status.raw_mbit_per_s, 4 * 24 * 8 * 30 / 1048576.0, 1e-3);
  EXPECT_NEAR(status.mbit_per_s,
              static_cast<double>(bench.host->report().deltas.at(0).payload_bytes) * 8 * 30 / 1048576, 1e-3);
  EXPECT_EQ(status.delta_bytes, bench.host->totals().payload_bytes);
}

// 24 bytes of position and velocity, 16 of orientation and 12 of angular velocity.
TEST(Publish, WhatIsRawCountsHowBodiesTurn) {
  Bench bench(turning_config());
  bench.poll();
  bench.enter(1, transport::Role::kObserver);
  bench.port.statuses.clear();
  bench.run_ms(3000);
  ASSERT_FALSE(bench.port.statuses.empty());
  const auto& status = bench.port.statuses.back();
  ASSERT_GT(status.bodies, 0U);
  EXPECT_NEAR(status.raw_mbit_per_s, status.bodies * 52 * 8 * status.frame_rate_hz / 1048576, 1e-6);
}

TEST(Publish, StatusTellsBytesByKind) {
  Bench bench;
  bench.poll();
  bench.enter(1);
  bench.joining(2);
  bench.on_ms = [&] { bench.playing(1, bench.host->frame()); };
  ASSERT_TRUE(bench.host->inject({.kind = 1, .values = {0, 0, -5}, .bytes = {}}));
  bench.run_ms(2'000);
  std::size_t replies = 0, inputs = 0, snapshots = 0;
  transport::Bytes cdr;
  for (const auto& reply : bench.port.replies) {
    cdr.clear();
    transport::write_cdr(reply, cdr);
    replies += cdr.size();
  }
  for (const auto& input : bench.port.scheduled) {
    cdr.clear();
    transport::write_cdr(input, cdr);
    inputs += cdr.size();
  }
  for (const auto& part : bench.port.snapshots) snapshots += part.bytes.size();
  const HostTotals totals = bench.host->totals();
  EXPECT_GT(replies, 0U);
  EXPECT_GT(inputs, 0U);
  EXPECT_GT(snapshots, 0U);
  EXPECT_EQ(totals.reply_bytes, replies);
  EXPECT_EQ(totals.input_bytes, inputs);
  EXPECT_EQ(totals.snapshot_bytes, snapshots);
  EXPECT_GT(bench.port.statuses.back().reply_bytes, 0U);
  EXPECT_EQ(bench.port.statuses.back().input_bytes, inputs);
}

TEST(Publish, BodiesThatComeAndGoTravelAsLifecycleAndTheCountFollows) {
  Bench bench;
  bench.poll();
  bench.run_to(5);
  bench.simulation.alive[1] = 0;
  bench.run_to(6);
  EXPECT_EQ(bench.host->agreed().alive()[1], 0);
  bench.simulation.alive[1] = 1;
  bench.simulation.position[2][1] = 9;
  bench.run_to(7);
  EXPECT_EQ(bench.host->agreed().alive()[1], 1);
  EXPECT_EQ(bench.host->agreed().reuse()[1], 1);
  EXPECT_EQ(bench.host->agreed().p(2)[1], 9 << 18);
  EXPECT_EQ(bench.host->agreed().alive_count(), 4U);
}

TEST(Publish, TheSessionTellsItsTimeGravityAndOrigin) {
  HostConfig config = test_config();
  config.up_axis = transport::UpAxis::kZ;
  config.continues_epoch = 5;
  config.continues_frame = 1234;
  FakeSimulation simulation(4);
  simulation.gravity_in_force = {0, 0, -9.5};
  simulation.body_names = {{3, "crane"}};
  FakePort port(participant(1));
  const auto host = Host::create(config, simulation, port);
  ASSERT_TRUE(host) << host.error().message;
  const transport::SessionMessage& session = (*host)->session();
  EXPECT_EQ(session.dt_s, 1.0 / 30);
  EXPECT_EQ(session.gravity, (std::array<double, 3>{0, 0, -9.5}));
  EXPECT_EQ(session.up_axis, transport::UpAxis::kZ);
  EXPECT_EQ(session.continues_epoch, 5U);
  EXPECT_EQ(session.continues_frame, 1234U);
  EXPECT_EQ(session.server_role, transport::ServerRole::kLive);
  EXPECT_EQ(session.standby_rank, 0U);
  EXPECT_EQ(session.names, (std::vector<transport::BodyName>{{3, 0, "crane"}}));
}

TEST(Publish, NamesGoOutWithTheSessionAndAgainWhenTheyChange) {
  using Names = std::vector<transport::BodyName>;
  Bench bench;
  bench.simulation.body_names = {{2, "b\n"}, {0, "a"}, {9, "nobody"}};
  bench.poll();
  bench.simulation.names_version_now = 1;
  bench.run_to(5);
  ASSERT_EQ(bench.port.sessions.size(), 2U) << "the names that the simulation has by now are told";
  EXPECT_EQ(bench.port.sessions[0].names, Names{});
  EXPECT_EQ(bench.port.sessions[1].names, (Names{{0, 0, "a"}, {2, 0, "b?"}}));
  const int asked = bench.simulation.asked_for_names;
  bench.run_to(60);
  EXPECT_EQ(bench.simulation.asked_for_names, asked) << "nothing changed";
  // The slot holds another body now.
  bench.simulation.alive[2] = 0;
  bench.run_to(61);
  bench.simulation.alive[2] = 1;
  bench.run_to(62);
  ASSERT_EQ(bench.port.sessions.size(), 3U);
  EXPECT_EQ(bench.port.sessions[2].names, (Names{{0, 0, "a"}, {2, 1, "b?"}}));
  EXPECT_EQ(bench.port.sessions[2].epoch, bench.port.sessions[0].epoch);
  EXPECT_EQ(bench.port.sessions[2].streams, bench.port.sessions[0].streams);
  // Changes in every frame go out once a second.
  bench.simulation.on_step = [&](std::uint64_t step) {
    bench.simulation.body_names = {{0, "frame " + std::to_string(step)}};
    bench.simulation.names_version_now = step;
  };
  bench.run_to(152);
  EXPECT_GE(bench.port.sessions.size(), 5U);
  EXPECT_LE(bench.port.sessions.size(), 7U);
}

TEST(Publish, ABodyThatTurnsIntoNanIsDespawnedAndTheStreamGoesOn) {
  Bench bench;
  bench.poll();
  bench.run_to(5);
  bench.simulation.position[0][3] = std::nanf("");
  bench.run_to(8);
  EXPECT_EQ(bench.host->agreed().alive_count(), 3U);
  EXPECT_EQ(bench.host->frame(), 8U);
}

TEST(Publish, TheAgreedStateFollowsTheSimulationWithinTheThreshold) {
  Bench bench;
  bench.simulation.on_step = [&](std::uint64_t step) {
    bench.simulation.position[0][0] = 0.01F * static_cast<float>(step * step % 97);
  };
  bench.poll();
  for (Frame frame = 1; frame < 200; ++frame) {
    bench.run_to(frame);
    const double agreed = bench.host->agreed().p(0)[0] * test_config().streams[0].lattice.unit;
    ASSERT_LE(std::abs(agreed - double{bench.simulation.position[0][0]}), 1.0 / 64 + 1e-5);
  }
}

TEST(Publish, TwoHostsOfTheSameInputsPublishTheSameBytes) {
  std::vector<transport::DeltaMessage> first;
  for (int run = 0; run < 2; ++run) {
    Bench bench;
    bench.simulation.on_step = [&](std::uint64_t step) {
      bench.simulation.position[step % 3][step % 4] += 0.3F * static_cast<float>(step % 5);
    };
    bench.poll();
    bench.enter(1);
    bench.on_ms = [&] { bench.playing(1, bench.host->frame()); };
    bench.send(bench.gravity(1, 1));
    bench.run_ms(2000);
    if (run == 0) first = bench.port.deltas;
    EXPECT_EQ(first, bench.port.deltas);
  }
}

}  // namespace
}  // namespace tandem::host
