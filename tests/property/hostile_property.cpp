#include <gtest/gtest.h>

#include "sdk/core/timeline/timeline.hpp"
#include "tests/property/synthetic.hpp"

// Received bytes that nobody sent: refused with the state untouched, or applied the same way by everybody.

namespace tandem {
namespace {

using synthetic::Random;
using Bytes = std::vector<std::byte>;

constexpr StreamParameters kParameters{{200, 16, 64}};

// Deltas of one codec over small states with lifecycle, parameters and corrections.
struct Corpus {
  State before;
  Bytes payload;
};

std::vector<Corpus> deltas_of(const synthetic::Coded& coded, std::uint32_t capacity, std::uint64_t seed) {
  Random random(seed);
  std::vector<Corpus> corpus;
  for (int i = 0; i < 20; ++i) {
    DeltaCodec server = synthetic::make_delta(coded.codec, capacity, kParameters, {}, coded.groups);
    Bytes out(server.bound());
    State state = synthetic::random_state(random, capacity, 4, coded.groups);
    const State before = state;
    State target = synthetic::random_target(random, state, 1 + random.below(6));
    const auto lifecycle = synthetic::random_lifecycle(random, state, target, 1 + random.below(12));
    if (random.one_in(2)) server.set_parameters({{100, 8, 32}});
    out.resize(server.encode(state, target, lifecycle, kNoBudget, out).size_bytes);
    corpus.push_back({before, out});
  }
  return corpus;
}

TEST(HostileDelta, AMutatedPayloadIsRefusedOrAppliedAlikeByEverybody) {
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  for (const synthetic::Coded& coded : synthetic::all_coded()) {
    SCOPED_TRACE(testing::Message() << coded.codec << (coded.groups.orientation ? ", turning" : ""));
    Random random(kSeed);
    int applied = 0;
    for (const std::uint32_t capacity : {1U, 9U, 40U}) {
      const auto corpus = deltas_of(coded, capacity, kSeed + capacity);
      DeltaCodec one = synthetic::make_delta(coded.codec, capacity, kParameters, {}, coded.groups);
      DeltaCodec two = synthetic::make_delta(coded.codec, capacity, kParameters, {}, coded.groups);
      for (int round = 0; round < 4000; ++round) {
        const Corpus& sample = corpus[random.below(corpus.size())];
        Bytes payload = sample.payload;
        synthetic::mutate(random, payload);
        // Exactly as large as its content, so that a sanitizer sees a read beyond it.
        const Bytes exact(payload.begin(), payload.end());
        State first = sample.before;
        State second = sample.before;
        one.restore_parameters(kParameters);
        two.restore_parameters(kParameters);
        const auto decoded = synthetic::receive(one, first, exact);
        ASSERT_EQ(synthetic::receive(two, second, exact).has_value(), decoded.has_value());
        ASSERT_EQ(first, second);
        ASSERT_EQ(one.parameters(), two.parameters());
        if (!decoded) {
          ASSERT_FALSE(decoded.error().message.empty());
          ASSERT_EQ(first, sample.before);
          ASSERT_EQ(one.parameters(), kParameters);
        } else {
          ++applied;
          ASSERT_EQ(synthetic::broken_invariant(first), nullptr);
        }
      }
    }
    EXPECT_GT(applied, 0) << "no mutation got through: the test has lost its point";
  }
}

TEST(HostileSnapshot, AMutatedSnapshotIsRefused) {
  constexpr std::uint64_t kSeed = 12;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  for (const std::uint32_t capacity : {1U, 30U, 200U}) {
    Layout layout;
    layout.capacity = capacity;
    layout.type_count = synthetic::kTypes;
    layout.codec = "entropy";
    layout.codec_tables = default_code_tables();
    layout.parameters = kParameters;
    layout.predictor = "ballistic";
    auto server = *ServerTimeline::create(layout, 5);
    const State start = synthetic::random_state(random, capacity);
    server.start(100, start, Drive{{1, 2, 3}, 4});
    ASSERT_TRUE(server.schedule({1, 105, Drive{{9, 9, 9}, 1}}));
    Bytes snapshot;
    server.snapshot(snapshot);
    auto client = *ClientTimeline::create(layout);
    for (int round = 0; round < 4000; ++round) {
      Bytes mutated = snapshot;
      synthetic::mutate(random, mutated);
      const Bytes exact(mutated.begin(), mutated.end());
      if (client.load(exact, 5)) {
        // Only values that the state hash does not cover can have changed.
        ASSERT_EQ(client.state(client.applied()), start);
        client.step(1);
        ASSERT_EQ(synthetic::broken_invariant(client.state(client.now())), nullptr);
      } else {
        ASSERT_FALSE(client.playing());
      }
    }
    for (std::size_t size = 0; size < snapshot.size(); ++size) {
      ASSERT_FALSE(client.load(std::span(snapshot).first(size), 5)) << "cut to " << size;
    }
    ASSERT_TRUE(client.load(snapshot, 5));
  }
}

}  // namespace
}  // namespace tandem
