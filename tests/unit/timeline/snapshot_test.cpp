#include "sdk/core/timeline/snapshot.hpp"
#include "sdk/core/tables/codec_table.hpp"

#include <gtest/gtest.h>

#include "tests/unit/timeline/session.hpp"

namespace tandem {
namespace {

using namespace synthetic;

std::unique_ptr<Codec> codec_for(std::uint32_t capacity) {
  return std::move(*make_codec({.name = "selective", .capacity = capacity}));
}

std::vector<std::byte> write(const Snapshot& snapshot, const State& state) {
  const auto codec = codec_for(state.capacity());
  std::vector<std::byte> bytes(snapshot_bytes_bound(state, *codec));
  ByteWriter out(bytes);
  write_snapshot(snapshot, state, *codec, out);
  EXPECT_FALSE(out.overflow());
  bytes.resize(out.size());
  return bytes;
}

Snapshot example() {
  Snapshot snapshot;
  snapshot.epoch = kEpoch;
  snapshot.stream = {3, 7};
  snapshot.frame = 1234567890123;
  snapshot.last_input = 9;
  snapshot.drive = {{1, -2, 3}, 4};
  snapshot.parameters = {{100, 10, 20, 5, 6}, {7}};
  snapshot.hash = 0xFEDCBA9876543210U;
  snapshot.leaves_hash = 0x0123456789ABCDEFU;
  snapshot.pending = {{8, snapshot.frame + 1, {{5, 5, 5}, 1}}, {9, snapshot.frame + 2, {{6, 6, 6}, 1}}};
  return snapshot;
}

TEST(Snapshot, ReadsBackWhatWasWritten) {
  Random random(6);
  for (const std::uint32_t capacity : {1U, 7U, 64U, 65U, 1000U}) {
    State state = random_state(random, capacity);
    for (Slot slot = 0; slot < capacity; ++slot) {
      if (state.alive()[slot] == 0) continue;
      state.c(1)[slot] = random.value(kVelocityLimit);
      state.rest()[slot] = static_cast<std::uint8_t>(random.below(2));
    }
    State loaded(capacity);
    const auto codec = codec_for(capacity);
    const auto read = read_snapshot(write(example(), state), kTypes, loaded, *codec);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(loaded, state);
    EXPECT_EQ(read->epoch, example().epoch);
    EXPECT_EQ(read->stream, example().stream);
    EXPECT_EQ(read->frame, example().frame);
    EXPECT_EQ(read->leaves_hash, example().leaves_hash);
    EXPECT_EQ(read->last_input, example().last_input);
    EXPECT_EQ(read->drive, example().drive);
    EXPECT_EQ(read->parameters, example().parameters);
    EXPECT_EQ(read->hash, example().hash);
    EXPECT_EQ(read->pending, example().pending);
  }
}

// One body in three rests.
State turned_state(Random& random, std::uint32_t capacity) {
  State state(capacity, {.orientation = true});
  for (Slot slot = 0; slot < capacity; ++slot) {
    if (random.one_in(4)) continue;
    BodyState body = random_body(random);
    body.q = any_quaternion(random);
    body.w = any_spin(random);
    state.spawn(slot, 0, 0, body);
    state.rest()[slot] = static_cast<std::uint8_t>(random.one_in(3));
  }
  return state;
}

TEST(Snapshot, ReadsBackOrientations) {
  Random random(9);
  for (const std::uint32_t capacity : {1U, 7U, 64U, 1000U}) {
    const State state = turned_state(random, capacity);
    State loaded(capacity, state.groups());
    const auto read = read_snapshot(write(example(), state), kTypes, loaded, *codec_for(capacity));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(loaded, state);
  }
}

TEST(Snapshot, OfOtherGroupsIsRefused) {
  Random random(10);
  const State turned = turned_state(random, 100);
  State plain(100);
  EXPECT_FALSE(read_snapshot(write(example(), turned), kTypes, plain, *codec_for(100)));
  State loaded(100, turned.groups());
  EXPECT_FALSE(read_snapshot(write(example(), random_state(random, 100)), kTypes, loaded, *codec_for(100)));
}

TEST(Snapshot, OrientationsThatNoStateMayHoldAreRefused) {
  const auto refused = [](const Quaternion& q, const Spin& w) {
    State state(3, {.orientation = true});
    state.spawn(1, 0, 0, {{1, 2, 3}, {}, q, w});
    State loaded(3, state.groups());
    return !read_snapshot(write(example(), state), kTypes, loaded, *codec_for(3)).has_value();
  };
  EXPECT_FALSE(refused(kNoTurn, {0, 0, kSpinLimit}));
  EXPECT_TRUE(refused({}, {})) << "zeros";
  EXPECT_TRUE(refused({0, 0, 0, kQuaternionOne + 1}, {})) << "a component";
  EXPECT_TRUE(refused({0, 0, 0, kQuaternionOne / 2}, {})) << "the norm";
  EXPECT_TRUE(refused(kNoTurn, {0, 0, -kSpinLimit - 1})) << "an axis";
  EXPECT_TRUE(refused(kNoTurn, {kSpinLimit, 1, 0})) << "the length";
}

TEST(Snapshot, CostsAtMostTwentyBytesABodyInAWorldOf23BitPositions) {
  Random random(7);
  State state(10000);
  for (Slot slot = 0; slot < 10000; ++slot) {
    BodyState body;
    for (std::int32_t& p : body.p) p = random.even(1 << 22);
    for (std::int32_t& v : body.v) v = random.even(1 << 19);
    state.spawn(slot, 0, static_cast<TypeId>(random.below(kTypes)), body);
  }
  EXPECT_LE(write(example(), state).size(), 20U * 10000U);
}

TEST(Snapshot, DeadSlotsCostNextToNothing) { EXPECT_LE(write(example(), State(80000)).size(), 100U + 200U); }

TEST(Snapshot, MultiplesOfAPowerOfTwoAreNotPaidForTheirZeros) {
  Random random(8);
  State state(1000), coarse(1000);
  for (Slot slot = 0; slot < 1000; ++slot) {
    BodyState body;
    for (std::int32_t& p : body.p) p = random.even(1 << 22);
    state.spawn(slot, 0, 0, body);
    for (std::int32_t& p : body.p) p = (p >> 12) * 4096;
    coarse.spawn(slot, 0, 0, body);
  }
  const std::size_t saved = write(example(), state).size() - write(example(), coarse).size();
  EXPECT_GE(saved, 3U * 12U * 1000U / 8U - 100U);
}

// Finds for each number the one that models take for least likely, as a world could that wants to do harm.
class Adversary {
 public:
  /// `guesses` false: of a column whose guess stays 0.
  Adversary(std::uint32_t most_bits, std::int64_t limit, bool guesses = true)
      : most_bits_(most_bits), limit_(limit), guesses_(guesses) {}
  std::int32_t next(unsigned halvings) {
    const auto unlikely = [](const LearningModel& model) { return model.p1 < 32768; };
    std::int64_t x = 0;
    if (unlikely(models_.some) || most_bits_ == 0) x = pick(unlikely);
    if (std::abs(guess_ + x) > limit_) x = -x;
    code_number(coder_, models_, x);
    const std::int64_t value = guess_ + x;
    if (guesses_) guess_ = halvings == 0 ? value : (guess_ + value) >> halvings;
    return static_cast<std::int32_t>(value);
  }

 private:
  template <class Unlikely>
  std::int64_t pick(const Unlikely& unlikely) {
    std::uint32_t node = 1;
    for (unsigned i = 0; i < 5; ++i) node = 2 * node + (unlikely(models_.length[node]) ? 1U : 0U);
    const std::uint32_t bits = std::min(node - 31, most_bits_);
    const std::size_t models = std::min<std::size_t>(bits, models_.sign.size() - 1);  // longer ones have none
    std::uint64_t value = 1;
    for (std::uint32_t left = bits - 1; left > 0; --left)
      value = 2 * value + (value < 4 && unlikely(models_.next[models][value]) ? 1U : 0U);
    return unlikely(models_.sign[models]) ? -static_cast<std::int64_t>(value)
                                          : static_cast<std::int64_t>(value);
  }

  std::uint32_t most_bits_;
  std::int64_t limit_;
  bool guesses_;
  std::int64_t guess_ = 0;
  NumberModels models_;
  std::vector<std::byte> nothing_;
  NumberEncoder coder_{nothing_};
};

TEST(Snapshot, NumbersThatMisleadItsModelsStayWithinTheBound) {
  for (const std::uint32_t bodies : {1U, 2U, 3U, 5U, 10U, 30U, 100U, 3000U}) {
    SCOPED_TRACE(bodies);
    for (const std::uint32_t spare_bits : {0U, 1U, 10U}) {
      Adversary p(30 - spare_bits, kPositionLimit), v(28 - spare_bits, kVelocityLimit);
      State state(bodies);
      for (Slot slot = 0; slot < bodies; ++slot) {
        state.spawn(slot, static_cast<std::uint8_t>(slot * 37U), static_cast<TypeId>(slot % kTypes), {});
        const std::int32_t at = p.next(0), speed = v.next(1);
        for (std::size_t i = 0; i < 3; ++i) {
          state.p(i)[slot] = at;
          state.v(i)[slot] = state.c(i)[slot] = speed;
        }
      }
      State loaded(bodies);
      ASSERT_TRUE(read_snapshot(write(example(), state), kTypes, loaded, *codec_for(bodies)));
      EXPECT_EQ(loaded, state);
    }
  }
}

TEST(Snapshot, OrientationsThatMisleadItsModelsStayWithinTheBound) {
  for (const std::uint32_t bodies : {1U, 2U, 3U, 5U, 10U, 30U, 100U, 3000U}) {
    SCOPED_TRACE(bodies);
    for (const std::uint32_t spare_bits : {0U, 1U, 10U}) {
      Adversary p(30 - spare_bits, kPositionLimit), v(28 - spare_bits, kVelocityLimit);
      Adversary q(30 - spare_bits, kQuaternionOne, false), w(29 - spare_bits, kSpinLimit, false);
      State state(bodies, {.orientation = true});
      for (Slot slot = 0; slot < bodies; ++slot) {
        state.spawn(slot, static_cast<std::uint8_t>(slot * 37U), static_cast<TypeId>(slot % kTypes), {});
        const std::int32_t at = p.next(0), speed = v.next(1), turn = q.next(0), spin = w.next(0);
        for (std::size_t i = 0; i < kPositionChannels; ++i) {
          state.p(i)[slot] = at;
          state.v(i)[slot] = state.c(i)[slot] = speed;
        }
        for (std::size_t i = 0; i < kQuaternionChannels; ++i) state.q(i)[slot] = turn;
        for (std::size_t i = 0; i < kSpinChannels; ++i) state.w(i)[slot] = spin;
      }
      write(example(), state);  // no turns that a state may hold, but bytes that fit
    }
  }
}

TEST(Snapshot, ValuesThatNoStateMayHoldAreRefused) {
  const auto refused = [](const Snapshot& snapshot, const State& state, TypeId types = kTypes) {
    State loaded(state.capacity());
    const auto codec = codec_for(state.capacity());
    return !read_snapshot(write(snapshot, state), types, loaded, *codec).has_value();
  };
  State state(3);
  state.spawn(1, 0, 2, {});
  EXPECT_FALSE(refused(example(), state));
  EXPECT_TRUE(refused(example(), state, 2)) << "type";
  State broken = state;
  broken.p(0)[1] = kPositionLimit + 1;
  EXPECT_TRUE(refused(example(), broken));
  broken = state;
  broken.v(2)[1] = -kVelocityLimit - 1;
  EXPECT_TRUE(refused(example(), broken));
  broken = state;
  broken.c(2)[1] = kVelocityLimit + 1;
  EXPECT_TRUE(refused(example(), broken));

  Snapshot snapshot = example();
  snapshot.parameters.codec.position_step = 0;
  EXPECT_TRUE(refused(snapshot, state));
  snapshot = example();
  snapshot.drive.gravity[0] = INT32_MAX;
  EXPECT_TRUE(refused(snapshot, state));
  snapshot = example();
  snapshot.frame = UINT64_MAX;
  EXPECT_TRUE(refused(snapshot, state));
  snapshot = example();
  std::swap(snapshot.pending[0], snapshot.pending[1]);
  EXPECT_TRUE(refused(snapshot, state)) << "inputs ascend";
  snapshot = example();
  snapshot.pending[1].number = 10;
  EXPECT_TRUE(refused(snapshot, state)) << "not issued yet";
  snapshot = example();
  snapshot.pending[0].frame = snapshot.frame;
  EXPECT_TRUE(refused(snapshot, state)) << "has acted already";
}

TEST(Snapshot, OfAnotherCapacityOrVersionIsRefused) {
  State state(3);
  State other(4);
  auto bytes = write(example(), state);
  EXPECT_EQ(read_snapshot(bytes, kTypes, other, *codec_for(4)).error().code, ErrorCode::kMalformed);
  bytes[4] = std::byte{1};
  EXPECT_EQ(read_snapshot(bytes, kTypes, state, *codec_for(3)).error().code, ErrorCode::kUnsupported);
}

TEST(Snapshot, TheHashOfAClientsStateIsChecked) {
  auto server = server_of(layout_for("selective", 3));
  auto client = client_of(layout_for("selective", 3));
  State state(3);
  state.spawn(1, 0, 0, {{1, 2, 3}, {}});
  server.start(0, state, {});
  auto bytes = snapshot_of(server);
  EXPECT_TRUE(client.load(bytes, kEpoch));
  bytes[51] ^= std::byte{1};  // a byte of the hash
  EXPECT_EQ(client.load(bytes, kEpoch).error().code, ErrorCode::kMismatch);
  EXPECT_FALSE(client.playing());
}

}  // namespace
}  // namespace tandem
