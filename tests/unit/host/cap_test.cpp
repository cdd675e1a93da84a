// A stream with a cap: what one client of it takes on the network stays within 5 % of the cap in any two
// seconds, whatever its bodies do, and the threshold says what that costs.
#include <gtest/gtest.h>

#include <random>

#include "services/host/streams/quality.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

using transport::DdsWire;
using transport::Role;

constexpr std::uint32_t kManyBodies = 400;

struct Load {
  const char* name;
  /// Moves the bodies of a simulation in a step.
  void (*move)(FakeSimulation& simulation, std::uint64_t step, std::mt19937& random);
  bool fills;  ///< it takes all that the cap permits
};

void shake(FakeSimulation& simulation, std::mt19937& random, float metres) {
  for (auto& column : simulation.position) {
    for (float& x : column)
      x = std::clamp(x + metres * (static_cast<float>(random() % 2001) / 1000 - 1), -60.0F, 60.0F);
  }
}

constexpr std::uint64_t kFramesASecond = 30;

const Load kSteady{
    "steady", [](FakeSimulation& s, std::uint64_t, std::mt19937& random) { shake(s, random, 0.1F); }, true};
const Load kBursts{"bursts",
                   [](FakeSimulation& s, std::uint64_t step, std::mt19937& random) {
                     if (step % (3 * kFramesASecond) < kFramesASecond / 3) shake(s, random, 1);
                   },
                   false};
const Load kRestThenBurst{"rest then burst",
                          [](FakeSimulation& s, std::uint64_t step, std::mt19937& random) {
                            if (step > 20 * kFramesASecond) shake(s, random, 2);
                          },
                          true};
const Load kTeleports{"teleports",
                      [](FakeSimulation& s, std::uint64_t step, std::mt19937& random) {
                        if (step % 45 == 0) shake(s, random, 60);
                      },
                      false};

HostConfig capped_config(std::uint32_t cap_kbit_s, std::uint32_t delay_ms) {
  HostConfig config = test_config();
  StreamConfig& stream = config.streams[0];
  stream.layout.codec = "tracker";
  EXPECT_TRUE(choose_gains(stream));
  stream.cap_kbit_s = cap_kbit_s;
  stream.delay_ms = delay_ms;
  const std::int32_t threshold = stream.layout.parameters.codec.threshold;
  stream.quality = QualityGoal{0, threshold, 64 * threshold};
  return config;
}

/// Adds up what an observer takes, as the network counts it.
class Meter {
 public:
  static constexpr std::int64_t kWindowNs = 2 * kSecond;

  void took(const transport::DeltaMessage& delta, std::int64_t now_ns) {
    std::uint64_t bytes = DdsWire::sample(WireCap::kFieldBytes + delta.payload.size(), true);
    if (now_ns - answered_ns_ >= DdsWire::kServerAsksNs) {
      bytes += DdsWire::kAnswerBytes;
      answered_ns_ = now_ns;
    }
    if (last_ns_ > 0)
      bytes += static_cast<std::uint64_t>((now_ns - last_ns_) / DdsWire::kShowsLifeNs) * DdsWire::kLifeBytes;
    last_ns_ = now_ns;
    all_.emplace_back(now_ns, bytes);
    total_ += bytes;
    window_ += bytes;
    while (now_ns - all_[first_].first >= kWindowNs) window_ -= all_[first_++].second;
    most_ = std::max(most_, window_);
  }
  [[nodiscard]] double most_kbit_s() const { return kbit_s(static_cast<double>(most_) / 2); }
  [[nodiscard]] double mean_kbit_s(double seconds) const {
    return kbit_s(static_cast<double>(total_) / seconds);
  }

 private:
  static double kbit_s(double bytes_per_s) {
    // Of a stream without deltas, but for its signs of life.
    const double any_case = DdsWire::of_observer(0, 0) - 2.5 * DdsWire::kLifeBytes;
    return (bytes_per_s + any_case) * 8 / 1000;
  }
  std::vector<std::pair<std::int64_t, std::uint64_t>> all_;
  std::size_t first_ = 0;
  std::uint64_t window_ = 0, most_ = 0, total_ = 0;
  std::int64_t answered_ns_ = 0, last_ns_ = 0;
};

struct Case {
  const Load& load;
  std::uint32_t cap_kbit_s, delay_ms;
};

class Capped : public ::testing::TestWithParam<Case> {
 protected:
  Meter run(Bench& bench, int seconds, const std::function<void()>& on_ms = {}) {
    std::mt19937 random(7);
    bench.simulation.rests = true;
    for (auto& column : bench.simulation.position)
      for (float& x : column) x = static_cast<float>(random() % 1000) / 20 - 25;
    bench.simulation.on_step = [&](std::uint64_t step) {
      GetParam().load.move(bench.simulation, step, random);
    };
    bench.enter(1, Role::kObserver);
    Meter meter;
    for (int ms = 0; ms < 1000 * seconds; ++ms) {
      if (on_ms) on_ms();
      if (ms % 5000 == 0) bench.playing(1, bench.host->frame(), Role::kObserver);
      bench.run_ms(1);
      for (const auto& delta : bench.port.deltas) meter.took(delta, bench.now);
      bench.port.deltas.clear();
    }
    return meter;
  }
};

TEST_P(Capped, AnyTwoSecondsStayWithinFivePercent) {
  const auto& [load, cap_kbit_s, delay_ms] = GetParam();
  Bench bench(capped_config(cap_kbit_s, delay_ms), kManyBodies);
  const double stated_m = bench.host->threshold_m();
  constexpr int kSeconds = 40;
  const Meter meter = run(bench, kSeconds);
  EXPECT_LE(meter.most_kbit_s(), 1.05 * cap_kbit_s);
  if (!load.fills) return;
  EXPECT_GT(meter.most_kbit_s(), 0.8 * cap_kbit_s) << "no more is held back than has to be";
  EXPECT_GT(bench.host->threshold_m(), 2 * stated_m) << "and it is told what that costs";
  EXPECT_EQ(bench.port.sessions.back().streams[0].cap_kbit_s, cap_kbit_s);
  EXPECT_EQ(bench.port.statuses.back().threshold, bench.host->threshold_m());
}

TEST_P(Capped, ClientsThatPushOnAndOnChangeNothing) {
  const auto& [load, cap_kbit_s, delay_ms] = GetParam();
  Bench bench(capped_config(cap_kbit_s, delay_ms), kManyBodies);
  bench.enter(2);
  std::uint64_t number = 0;
  const Meter meter = run(bench, 30, [&] {
    if (bench.now / kMillisecond % 20 == 0) bench.send(bench.push(2, ++number));
    if (bench.now / kMillisecond % 50 == 0) bench.playing(2, bench.host->frame());
  });
  EXPECT_LE(meter.most_kbit_s(), 1.05 * cap_kbit_s);
}

constexpr std::uint32_t kNoDelay = 0, kDelay = 200, kLongDelay = 1000;
INSTANTIATE_TEST_SUITE_P(
    Loads, Capped,
    ::testing::Values(Case{kSteady, 100, kNoDelay}, Case{kSteady, 100, kDelay}, Case{kSteady, 16, kLongDelay},
                      Case{kSteady, 150, kNoDelay}, Case{kBursts, 100, kNoDelay}, Case{kBursts, 64, kDelay},
                      Case{kRestThenBurst, 100, kNoDelay}, Case{kRestThenBurst, 64, kDelay},
                      Case{kRestThenBurst, 32, kLongDelay}, Case{kTeleports, 100, kNoDelay},
                      Case{kTeleports, 64, kDelay}, Case{kTeleports, 32, kLongDelay}),
    [](const auto& of) {
      std::string name = of.param.load.name;
      std::erase(name, ' ');
      return name + std::to_string(of.param.cap_kbit_s) + "kbit" + std::to_string(of.param.delay_ms) + "ms";
    });

TEST(Cap, OneThatCannotHoldHeadersIsRefusedWithBothNumbers) {
  const auto refusal = [](std::uint32_t cap_kbit_s, std::uint32_t delay_ms) -> std::string {
    FakeSimulation simulation(4);
    FakePort port(participant(0xAA));
    const auto host = Host::create(capped_config(cap_kbit_s, delay_ms), simulation, port);
    return host ? "" : host.error().message;
  };
  EXPECT_NE(refusal(40, 0).find("a cap of 40 kbit/s has no room for headers, which need 6"),
            std::string::npos)
      << refusal(40, 0);
  EXPECT_EQ(refusal(40, 200), "") << "a delay shares headers";
  EXPECT_NE(refusal(15, 1000).find("16 to 10,000,000"), std::string::npos) << refusal(15, 1000);
  EXPECT_NE(refusal(10'000'001, 1000), "");
}

/// What clients that say `cap_kbit_s` are answered, and how many accounts there are then.
std::pair<const transport::ReplyMessage*, std::uint64_t> join(Bench& bench, transport::ClientId client,
                                                              std::uint32_t cap_kbit_s) {
  bench.port.replies.clear();
  auto ack = bench.ack(client, transport::Phase::kJoining, 0, Role::kObserver);
  ack.cap_kbit_s = cap_kbit_s;
  bench.send(ack);
  bench.run_ms(1100);
  return {bench.last_reply(client), bench.host->totals().clients_seen};
}

TEST(Cap, AClientBelowTheStreamsIsRefusedWithTheSmallestThatWouldDo) {
  constexpr auto kRefused = static_cast<std::uint32_t>(transport::Reason::kCap);
  Bench bench(capped_config(100, 0));
  bench.run_ms(100);
  for (const std::uint32_t cap_kbit_s : {99U, 1U, 15U, 10'000'001U, UINT32_MAX}) {
    const auto [reply, seen] = join(bench, 1, cap_kbit_s);
    ASSERT_NE(reply, nullptr) << cap_kbit_s;
    EXPECT_EQ(reply->reason, kRefused);
    EXPECT_EQ(reply->needed_kbit_s, 100U);
    EXPECT_EQ(seen, 0U) << "no account for it";
  }
  for (const std::uint32_t cap_kbit_s : {100U, 0U}) {
    const auto [reply, seen] = join(bench, 1, cap_kbit_s);
    EXPECT_EQ(seen, 1U);
    EXPECT_TRUE(reply == nullptr || reply->reason == 0);
  }
  const auto [reply, seen] = join(bench, 1, 64);
  ASSERT_NE(reply, nullptr);
  EXPECT_EQ(reply->reason, kRefused) << "one that is known is told the same";
  EXPECT_EQ(reply->needed_kbit_s, 100U);
}

TEST(Cap, AStreamWithoutOneIsTheClientsOwnChoice) {
  Bench bench(test_config());
  bench.run_ms(2000);
  EXPECT_EQ(join(bench, 1, 16).second, 1U);
  const auto [reply, seen] = join(bench, 2, 15);
  ASSERT_NE(reply, nullptr);
  EXPECT_EQ(reply->reason, static_cast<std::uint32_t>(transport::Reason::kCap));
  EXPECT_GT(reply->needed_kbit_s, 40U) << "30 messages a second";
}

TEST(Cap, StreamsOfTwoCapsAreEncodedForThemselves) {
  StreamConfig a = capped_config(100, 0).streams[0], b = a;
  b.delay_ms = 200;
  EXPECT_TRUE(same_encoding(a, b));
  b.cap_kbit_s = 64;
  EXPECT_FALSE(same_encoding(a, b));
}

}  // namespace
}  // namespace tandem::host
