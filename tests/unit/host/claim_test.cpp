#include <gtest/gtest.h>

#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

transport::Received<transport::SessionMessage> rival(std::int64_t epoch_difference_ms, std::uint8_t tag) {
  transport::SessionMessage session;
  session.session = "unit";
  session.epoch = static_cast<Epoch>(static_cast<std::int64_t>(test_config().epoch) + epoch_difference_ms);
  return {session, participant(tag)};
}

HostConfig claiming_config() {
  HostConfig config = test_config();
  config.claim_ns = kSecond / 2;
  return config;
}

TEST(Claim, AnnouncesNothingForHalfASecondAndThenTheSession) {
  Bench bench(claiming_config());
  bench.poll();
  bench.run_ms(499);
  EXPECT_EQ(bench.host->state(), Host::State::kClaiming);
  EXPECT_TRUE(bench.port.order.empty());
  bench.run_ms(2);
  EXPECT_EQ(bench.host->state(), Host::State::kRunning);
  ASSERT_FALSE(bench.port.order.empty());
  EXPECT_EQ(bench.port.order.front(), "session");
}

TEST(Claim, ASecondServerSeesTheFirstAndRefusesNamingIt) {
  Bench bench(claiming_config());
  bench.poll();
  bench.run_ms(300);
  bench.port.rivals.push_back(rival(-60'000, 0x0B));
  bench.run_ms(1);
  EXPECT_EQ(bench.host->state(), Host::State::kRefused);
  ASSERT_TRUE(bench.host->error());
  EXPECT_EQ(bench.host->error()->code, ErrorCode::kConflict);
  EXPECT_NE(bench.host->error()->message.find("1699999940000"), std::string::npos);
  EXPECT_NE(bench.host->error()->message.find("0b0b0b0b"), std::string::npos);
  EXPECT_TRUE(bench.port.order.empty());
}

TEST(Claim, AServerThatStandsByHasNoClaimButTheTimeToTakeOver) {
  Bench bench(claiming_config());
  auto standby = rival(-60'000, 0x0B);
  standby.message.server_role = transport::ServerRole::kStandby;
  bench.port.rivals.push_back(standby);
  bench.poll();
  bench.run_ms(5400);
  EXPECT_EQ(bench.host->state(), Host::State::kClaiming);
  bench.run_ms(200);
  EXPECT_EQ(bench.host->state(), Host::State::kRunning);
}

TEST(Claim, AServerThatGoesOnFromACheckpointDoesNotWaitForOneThatStandsBy) {
  HostConfig config = claiming_config();
  config.continues_epoch = 1;
  Bench bench(std::move(config));
  auto standby = rival(-60'000, 0x0B);
  standby.message.server_role = transport::ServerRole::kStandby;
  bench.port.rivals.push_back(standby);
  bench.poll();
  bench.run_ms(600);
  EXPECT_EQ(bench.host->state(), Host::State::kRunning);
}

TEST(Claim, AServerThatHearsAnotherAnnouncesItselfAgainOnceASecond) {
  Bench bench;
  bench.poll();
  bench.run_ms(3000);
  const std::size_t before = bench.port.sessions.size();
  bench.port.rivals.push_back(rival(-60'000, 0x0B));
  bench.run_ms(3500);
  ASSERT_EQ(bench.host->state(), Host::State::kRunning);
  EXPECT_EQ(bench.port.sessions.size(), before + 4);
  bench.port.rivals.clear();
  bench.run_ms(3000);
  EXPECT_LE(bench.port.sessions.size(), before + 5);
}

TEST(Claim, BeforeAnnouncingEvenAHigherGuidWins) {
  Bench bench(claiming_config());
  bench.port.rivals.push_back(rival(10, 0xFF));
  bench.poll();
  EXPECT_EQ(bench.host->state(), Host::State::kRefused);
}

TEST(Claim, OfTwoStartingAtOnceTheLowerGuidStays) {
  Bench lower;
  lower.poll();
  lower.port.rivals.push_back(rival(-1500, 0xAB));
  lower.run_ms(1000);
  EXPECT_EQ(lower.host->state(), Host::State::kRunning);

  Bench higher;
  higher.poll();
  higher.port.rivals.push_back(rival(1500, 0xA9));
  higher.run_ms(1000);
  EXPECT_EQ(higher.host->state(), Host::State::kRefused);
  EXPECT_EQ(higher.host->error()->code, ErrorCode::kConflict);
}

TEST(Claim, AServerOlderByMoreThanTwoSecondsStaysWhateverItsGuid) {
  Bench older;
  older.poll();
  older.port.rivals.push_back(rival(2001, 0x01));
  older.run_ms(1000);
  EXPECT_EQ(older.host->state(), Host::State::kRunning);

  Bench younger;
  younger.poll();
  younger.port.rivals.push_back(rival(-2001, 0xFF));
  younger.run_ms(1000);
  EXPECT_EQ(younger.host->state(), Host::State::kRefused);
}

// Clients that acknowledge the epoch of a server, four times a second.
void follow(Bench& bench, Epoch epoch, std::uint8_t first, std::uint8_t count) {
  for (std::uint8_t i = 0; i < count; ++i) {
    const auto tag = static_cast<std::uint8_t>(first + i);
    auto ack = bench.ack(tag, transport::Phase::kJoining, 0, transport::Role::kObserver);
    ack.epoch = epoch;
    bench.port.acks.push_back({ack, participant(tag)});
  }
}

struct Followed {
  std::uint8_t ours = 0, theirs = 0;
};

Host::State after_ten_seconds(Followed followers, const transport::Received<transport::SessionMessage>& other,
                              std::vector<std::string>* notices = nullptr) {
  Bench bench;
  bench.poll();
  int ms = 0;
  bench.on_ms = [&] {
    if (++ms == 3000) bench.port.rivals.push_back(other);
    if (ms % 250 != 0) return;
    follow(bench, test_config().epoch, 1, followers.ours);
    follow(bench, other.message.epoch, 100, followers.theirs);
  };
  bench.run_ms(10'000);
  if (notices != nullptr) *notices = bench.host->take_notices();
  return bench.host->state();
}

TEST(Claim, AnAnnouncementThatNobodyFollowsEndsNobodyAndIsToldOnce) {
  for (const auto ours : std::initializer_list<std::uint8_t>{0, 1, 5}) {
    std::vector<std::string> notices;
    EXPECT_EQ(after_ten_seconds({ours, 0}, rival(-60'000, 0x01), &notices), Host::State::kRunning);
    EXPECT_EQ(std::ranges::count_if(
                  notices, [](const auto& line) { return line.find("1699999940000") != std::string::npos; }),
              1);
  }
}

TEST(Claim, AServerThatWasAwayLeavesToTheOneThatIsFollowedNow) {
  EXPECT_EQ(after_ten_seconds({0, 1}, rival(60'000, 0xFF)), Host::State::kRefused);
  EXPECT_EQ(after_ten_seconds({2, 3}, rival(60'000, 0xFF)), Host::State::kRefused);
}

TEST(Claim, TheOneThatTookOverStaysWhateverTheAgeOfTheOther) {
  EXPECT_EQ(after_ten_seconds({1, 0}, rival(-60'000, 0x01)), Host::State::kRunning);
  EXPECT_EQ(after_ten_seconds({3, 2}, rival(-60'000, 0x01)), Host::State::kRunning);
}

TEST(Claim, OfTwoFollowedAlikeExactlyOneStays) {
  EXPECT_EQ(after_ten_seconds({2, 2}, rival(-60'000, 0xFF)), Host::State::kRefused);
  EXPECT_EQ(after_ten_seconds({2, 2}, rival(60'000, 0x01)), Host::State::kRunning);
}

// Their followers cannot be told apart.
TEST(Claim, WhoAnnouncesThisServersEpochIsNoServerAndIsToldOnce) {
  std::vector<std::string> notices;
  EXPECT_EQ(after_ten_seconds({2, 2}, rival(0, 0x01), &notices), Host::State::kRunning);
  EXPECT_EQ(
      std::ranges::count_if(
          notices, [](const auto& line) { return line.find("announces epoch 17000") != std::string::npos; }),
      1);
}

TEST(Claim, OfTwoThatStartedWithOneEpochTheLowerGuidStays) {
  for (const auto& [tag, state] :
       {std::pair{std::uint8_t{0x01}, Host::State::kRefused}, {std::uint8_t{0xFF}, Host::State::kRunning}}) {
    Bench bench;
    bench.poll();
    bench.port.rivals.push_back(rival(0, tag));
    bench.run_ms(10'000);
    EXPECT_EQ(bench.host->state(), state);
  }
}

// Two relays may publish one epoch, where only relays can.
TEST(Claim, WhereTheNetworkVouchesForServersOneOfTwoWithOneEpochLeaves) {
  Bench bench;
  bench.port.vouches = true;
  bench.poll();
  bench.run_ms(3000);
  bench.port.rivals.push_back(rival(0, 0x01));
  for (int i = 0; i < 20; ++i) {
    follow(bench, test_config().epoch, 1, 2);
    bench.run_ms(250);
  }
  EXPECT_EQ(bench.host->state(), Host::State::kRefused);
}

// Clients acknowledge the epoch before for a moment.
TEST(Claim, WhoAnnouncesTheEpochThatIsTakenOverIsNoServer) {
  HostConfig config = test_config();
  config.continues_epoch = config.epoch - 5000;
  config.takes_over_from = participant(0x0B);
  Bench bench(std::move(config));
  bench.port.rivals.push_back(rival(-5000, 0x0C));
  for (int i = 0; i < 20; ++i) {
    follow(bench, test_config().epoch - 5000, 1, 2);
    bench.run_ms(250);
  }
  EXPECT_EQ(bench.host->state(), Host::State::kRunning);
  // The server itself may have hung, and still have its clients.
  bench.port.rivals = {rival(-5000, 0x0B)};
  for (int i = 0; i < 20; ++i) {
    follow(bench, test_config().epoch - 5000, 1, 2);
    bench.run_ms(250);
  }
  EXPECT_EQ(bench.host->state(), Host::State::kRefused);
}

// Observers acknowledge every two seconds, and not at the same time.
TEST(Claim, OfTwoFollowedByObserversExactlyOneStays) {
  const auto ends = [](const transport::Received<transport::SessionMessage>& other) {
    Bench bench;
    bench.poll();
    bench.run_ms(3000);
    bench.port.rivals.push_back(other);
    for (int i = 0; i < 5; ++i) {
      follow(bench, test_config().epoch, 1, 1);
      bench.run_ms(1000);
      follow(bench, other.message.epoch, 100, 1);
      bench.run_ms(1000);
    }
    return bench.host->state();
  };
  EXPECT_EQ(ends(rival(-60'000, 0xFF)), Host::State::kRefused);
  EXPECT_EQ(ends(rival(60'000, 0x01)), Host::State::kRunning);
}

TEST(Claim, ARefusedServerProducesNothingMore) {
  Bench bench(claiming_config());
  bench.port.rivals.push_back(rival(-60'000, 0x0B));
  bench.poll();
  bench.port.rivals.clear();
  bench.run_ms(2000);
  EXPECT_EQ(bench.host->state(), Host::State::kRefused);
  EXPECT_TRUE(bench.port.order.empty());
  EXPECT_EQ(bench.simulation.steps, 0U);
}

TEST(HostCreate, RefusesAConfigurationThatMakesNoSession) {
  FakeSimulation simulation(4);
  FakePort port(participant(1));
  const auto refused = [&](const std::function<void(HostConfig&)>& spoil) {
    HostConfig config = test_config();
    spoil(config);
    return !Host::create(std::move(config), simulation, port).has_value();
  };
  EXPECT_FALSE(refused([](HostConfig&) {}));
  EXPECT_TRUE(refused([](HostConfig& c) { c.session = "a*"; }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.session.clear(); }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.frame_rate_hz = 0; }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.frame_rate_hz = std::nan(""); }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.streams[0].layout.lead = 2; }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.window = 0; }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.window = 25; }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.client_limit = 0; }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.types.clear(); }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.epoch = 0; }));
  // Every client would drop such an announcement without a word.
  EXPECT_FALSE(refused([](HostConfig& c) { c.scene.assign(64, 's'); }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.scene.assign(65, 's'); }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.scene_json.assign((1U << 20U) + 1, 'd'); }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.types[0].name.assign(65, 't'); }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.types[0].radius = std::nanf(""); }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.types[0].radius = -1; }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.types[0].shape = transport::Shape::kBox; }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.streams[0].layout.codec = "morse"; }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.streams[0].layout.predictor = "oracle"; }));
  EXPECT_TRUE(refused([](HostConfig& c) { c.streams[0].layout.parameters.codec.threshold = 0; }));
}

TEST(HostCreate, RefusesASimulationWhoseColumnsAreTooShort) {
  FakeSimulation simulation(4);
  simulation.velocity[1].pop_back();
  FakePort port(participant(1));
  const auto host = Host::create(test_config(), simulation, port);
  ASSERT_FALSE(host);
  EXPECT_EQ(host.error().code, ErrorCode::kInvalidArgument);
}

TEST(HostCreate, DescribesTheSessionCompletely) {
  HostConfig config = test_config();
  config.scene = "half_pipe";
  config.scene_json = R"({"description":"half_pipe"})";
  config.types = {{.name = "ball", .radius = 0.1F, .colour_rgba = 0xFF0000FF}};
  Bench bench(config);
  bench.poll();
  ASSERT_EQ(bench.port.sessions.size(), 1U);
  const auto& session = bench.port.sessions[0];
  EXPECT_EQ(session, bench.host->session());
  EXPECT_EQ(session.epoch, config.epoch);
  EXPECT_EQ(session.capacity, 4U);
  EXPECT_EQ(session.lattice_unit, config.streams[0].lattice.unit);
  EXPECT_EQ(session.lead, 1U);
  EXPECT_EQ(session.window_ceiling, 24U);
  EXPECT_EQ(session.scene, "half_pipe");
  EXPECT_EQ(session.types, config.types);
  ASSERT_EQ(session.streams.size(), 1U);
  const auto& stream = session.streams[0];
  EXPECT_EQ(stream.id, StreamId{});
  EXPECT_EQ(stream.layout, config.streams[0].layout);
  EXPECT_EQ(stream.layout_hash, transport::layout_hash(session, stream));
  EXPECT_GT(stream.max_delta_bytes, 0U);
  EXPECT_GT(stream.max_snapshot_bytes, 0U);
}

// A clock that is asked twice for each of nine measurements: they take 1, 2, ... 9 us.
std::int64_t uneven_clock() {
  static std::int64_t asked = 0;
  const std::int64_t pair = asked++ / 2 % 9;
  return asked % 2 == 0 ? 1'000 * (pair + 1) : 0;
}

TEST(Announcement, TheCostOfAClientIsMeasured) {
  HostConfig config = test_config();
  config.clock_ns = uneven_clock;
  EXPECT_EQ(Bench(config).host->session().streams[0].client_cost_ns, 5'000U / 4) << "median, per body";
  config.clock_ns = nullptr;
  EXPECT_EQ(Bench(config).host->session().streams[0].client_cost_ns, 0U) << "not measured";
}

// Each measurement takes a microsecond.
std::int64_t even_clock() {
  static std::int64_t now_ns = 0;
  return now_ns += 1'000;
}

TEST(Announcement, TheCostOfAClientIsMeasuredBeforeThereIsABody) {
  HostConfig config = test_config();
  config.clock_ns = even_clock;
  for (const std::uint32_t capacity : {4U, 4096U, 10'000U}) {
    config.streams[0].layout.capacity = capacity;
    FakeSimulation simulation(capacity);
    std::ranges::fill(simulation.alive, 0);
    FakePort port(participant(0xAA));
    const auto host = Host::create(config, simulation, port);
    ASSERT_TRUE(host) << host.error().message;
    EXPECT_EQ((*host)->session().streams[0].client_cost_ns, capacity == 4 ? 250U : 1U) << "rounded up";
  }
}

// Each frame takes 50 ms.
std::int64_t slow_clock() {
  static std::int64_t now_ns = 0;
  return now_ns += 50 * kMillisecond;
}

TEST(Host, ASimulationTooSlowForItsRateIsLogged) {
  const auto notices = [](std::int64_t (*clock_ns)(), bool free_rate) {
    HostConfig config = test_config();
    config.clock_ns = clock_ns;
    config.free_rate = free_rate;
    Bench bench(config);
    bench.poll();
    bench.run_to(90);
    std::vector<std::string> about;
    for (std::string& line : bench.host->take_notices())
      if (line.starts_with("the session runs at")) about.push_back(std::move(line));
    return about;
  };
  EXPECT_EQ(notices(slow_clock, false).size(), 1U) << "90 frames are three seconds";
  EXPECT_EQ(notices(slow_clock, true).size(), 0U) << "no rate that it should keep";
  EXPECT_EQ(notices(even_clock, false).size(), 0U);
}

}  // namespace
}  // namespace tandem::host
