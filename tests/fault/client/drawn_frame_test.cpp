// The drawn moment never goes back within an epoch, whatever the network, the server and the client's loads
// do.
#include <algorithm>
#include <array>
#include <deque>

#include "tests/support/client/fake_server.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem::client {
namespace {

constexpr StreamId kOther{1, 0};

/// A world told as two streams, on a bad network, by a server that halts now and then, to a client that is
/// polled and sampled when its machine has time.
class DrawnFrameTest : public ClientTest {
 protected:
  void live(std::uint64_t seed) {
    dice = Dice(seed);
    core.reset();
    server = FakeServer(1000 + 8 * seed, 12);
    server.session.streams.push_back(server.session.streams[0]);
    server.session.streams[1].id = kOther;
    port = FakePort();
    on_the_way.clear();
    kept.clear();
    last = {};
    start(static_cast<std::uint32_t>(dice.below(2)));
    core->prefer("0");
    core->start_sampling();
    port.sessions.push_back(from_server(server.session));
    due_ns = now_ns;
    for (int i = 0; i < 3000 && !HasFailure(); ++i) {
      // A machine under load sleeps for long now and then.
      now_ns += dice.one_in(40) ? below_ms(200) : below_ms(12);
      publish();
      arrive();
      if (dice.one_in(400)) core->prefer(dice.one_in(2) ? "0" : "1");
      if (dice.one_in(600)) core->show_uncorrected(dice.one_in(2));
      if (!dice.one_in(4)) core->poll({now_ns, wall_ns()});
      answer();
      look(SampleMode::kExtrapolate, 8 * below_ms(3));
      if (dice.one_in(3)) look(SampleMode::kInterpolate, 0);
    }
  }

  double furthest_back = 0;
  int samples = 0;

 private:
  struct OnTheWay {
    std::int64_t at_ns;
    transport::DeltaMessage delta;
  };

  std::int64_t below_ms(std::uint64_t limit) { return static_cast<std::int64_t>(dice.below(limit)) * kMs; }
  void publish() {
    while (due_ns <= now_ns) {
      auto delta = server.advance(due_ns + 500 * kMs + below_ms(3));
      kept.push_back(server.snapshot());
      if (kept.size() > 60) kept.pop_front();
      // Some arrive late, and all that follow wait for them; few are lost.
      slow_ns = dice.one_in(60) ? below_ms(400) : slow_ns / 2;
      if (!dice.one_in(300)) on_the_way.push_back({due_ns + 5 * kMs + slow_ns, std::move(delta)});
      due_ns += dice.one_in(200) ? below_ms(3000) : kFrameNs;
    }
  }
  void arrive() {
    while (!on_the_way.empty() && on_the_way.front().at_ns <= now_ns) {
      auto delta = std::move(on_the_way.front().delta);
      on_the_way.pop_front();
      for (const std::uint32_t stream : port.streams_open) {
        delta.stream = {stream, 0};
        deliver(delta);
      }
    }
  }
  // Of the present; or, as a server's that keeps snapshots for all, of some time ago.
  void answer() {
    if (port.snapshots_open.empty() || kept.empty() || !port.snapshots.empty() || dice.one_in(3)) return;
    const std::size_t ago = dice.one_in(2) ? dice.below(kept.size()) : 0;
    transport::SnapshotMessage snapshot = kept[kept.size() - 1 - ago];
    const StreamId stream{*port.snapshots_open.begin(), 0};
    auto timeline = std::move(*ClientTimeline::create(server.session.streams[stream.id].layout));
    ASSERT_TRUE(timeline.load(snapshot.bytes, snapshot.epoch).has_value());
    timeline.rename(snapshot.epoch, stream);
    timeline.snapshot(snapshot.bytes);
    snapshot.total_bytes = static_cast<std::uint32_t>(snapshot.bytes.size());
    snapshot.stream = stream;
    port.snapshots.push_back(from_server(std::move(snapshot)));
  }
  void look(SampleMode mode, std::int64_t later_ns) {
    Seen& seen = last[static_cast<std::size_t>(mode)];
    const std::int64_t at_ns = std::max(now_ns + later_ns, seen.at_ns);
    SampleColumns columns{.capacity = 12};
    const auto sampled =
        core->sample({.mode = mode, .at_ns = later_ns == 0 ? 0 : at_ns}, columns, {now_ns, wall_ns()});
    if (!sampled) return;
    ++samples;
    EXPECT_GE(sampled->frame, seen.frame) << "sample " << samples;
    furthest_back = std::max(furthest_back, seen.frame - sampled->frame);
    seen = {sampled->frame, later_ns == 0 ? seen.at_ns : at_ns};
  }

  struct Seen {
    double frame = 0;
    std::int64_t at_ns = 0;
  };
  Dice dice{1};
  std::int64_t due_ns = 0, slow_ns = 0;
  std::deque<OnTheWay> on_the_way;
  std::deque<transport::SnapshotMessage> kept;
  std::array<Seen, 2> last{};
};

TEST_F(DrawnFrameTest, NeverGoesBackWhateverArrivesWhen) {
  std::uint64_t resyncs = 0, changes = 0;
  for (std::uint64_t seed = 1; seed <= 40 && !HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    live(seed);
    resyncs += figures().resyncs;
    changes += figures().stream_changes;
  }
  EXPECT_EQ(furthest_back, 0);
  EXPECT_GT(samples, 20'000);
  EXPECT_GT(resyncs, 40U);
  EXPECT_GT(changes, 40U);
}

}  // namespace
}  // namespace tandem::client
