#include "sdk/core/predict/contact/contact.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string_view>
#include <vector>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/core/predict/contact/cell_choice.hpp"
#include "sdk/core/predict/contact/pairs.hpp"
#include "sdk/core/predict/contact/walls.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "tests/unit/core/contact_world.hpp"

namespace tandem {
namespace {

constexpr std::array<std::string_view, 2> kTiers{"contact", "field"};

class ContactTiers : public testing::TestWithParam<std::string_view> {};
INSTANTIATE_TEST_SUITE_P(Tiers, ContactTiers, testing::ValuesIn(kTiers));

TEST_P(ContactTiers, InPlaceEqualsApartForAnyState) {
  constexpr std::uint64_t kSeed = 51;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  for (const std::int32_t reach : {0, 10, kRadius, 20 * kRadius, kPositionLimit}) {
    for (const std::int32_t speed : {0, 100000, kVelocityLimit}) {
      for (const std::int32_t substeps : {1, 2, 16}) {
        const auto predictor = predictor_of(GetParam(), 300, constants_of(substeps));
        State state = bodies_within(random, 300, reach, speed);
        State apart(300);
        for (int frame = 0; frame < 4; ++frame) {
          predictor->step(state, apart, kFalling);
          predictor->step(state, state, kFalling);
          ASSERT_EQ(state, apart);
        }
        for (Slot s = 0; s < 300; ++s) {
          for (std::size_t i = 0; i < 3; ++i) {
            ASSERT_LE(std::abs(state.p(i)[s]), kPositionLimit);
            ASSERT_LE(std::abs(state.v(i)[s]), kVelocityLimit);
            ASSERT_TRUE(state.alive()[s] != 0 || (state.p(i)[s] | state.v(i)[s] | state.c(i)[s]) == 0);
          }
        }
      }
    }
  }
}

TEST_P(ContactTiers, AWorldWithoutBodiesStaysEmpty) {
  for (const std::uint32_t capacity : {1U, 3U, 65U}) {
    for (const std::int32_t substeps : {1, 2}) {
      const auto predictor = predictor_of(GetParam(), capacity, constants_of(substeps));
      const State from(capacity);
      State to = from;
      predictor->step(from, to, kFalling);
      predictor->step(to, to, kFalling);
      EXPECT_EQ(to, from);
    }
  }
}

TEST_P(ContactTiers, ExtremeConstantsMeetExtremeStates) {
  constexpr std::uint64_t kSeed = 52;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  for (const std::int32_t substeps : {1, ContactConstants::kMaxSubsteps}) {
    ContactConstants constants = constants_of(substeps);
    constants.pair = constants.wall = {ContactMaterial::kMaxSpring, ContactMaterial::kMaxDamping,
                                       ContactMaterial::kMaxDamping};
    const Vec3i ones{ContactConstants::kOne, ContactConstants::kOne, ContactConstants::kOne};
    const Vec3i corner{kPositionLimit, -kPositionLimit, kPositionLimit};
    constants.planes = {{ones, kPositionLimit}, {ones, -kPositionLimit}};
    constants.boxes = {{corner, {kPositionLimit, kPositionLimit, kPositionLimit}, {ones, ones, ones}}};
    constants.balls = {{corner, kPositionLimit}, {{}, 0}};
    for (const std::int32_t radius : {1, 2, 100, ContactConstants::kMaxRadius}) {
      constants.types = {{radius, ContactConstants::kMaxMobility}};
      const auto predictor = predictor_of(GetParam(), 200, constants);
      for (const std::int32_t reach : {0, 1, kPositionLimit}) {
        State state = bodies_within(random, 200, reach, kVelocityLimit);
        for (int frame = 0; frame < 5; ++frame) predictor->step(state, state, kFalling);
        EXPECT_GT(state.alive_count(), 0U);
      }
    }
  }
}

TEST(Contact, TwoBodiesPartWithEqualAndOppositeSpeed) {
  ContactConstants constants = constants_of(1);
  constants.planes.clear();
  const auto predictor = predictor_of("contact", 2, constants);
  State state(2);
  state.spawn(0, 0, 0, {{0, 0, 0}, {}});
  state.spawn(1, 0, 0, {{3 * kRadius / 2, 0, 0}, {}});
  predictor->step(state, state, {});
  EXPECT_LT(state.v(0)[0], 0);
  EXPECT_EQ(state.v(0)[0], -state.v(0)[1]);
  // Half a radius of overlap, times the spring.
  EXPECT_NEAR(state.v(0)[1], 64.0 * (kRadius / 2.0) * 3641 / 16384, 64.0 * kRadius / 1000);
}

TEST(Contact, BodiesApartMoveAsBallistic) {
  std::mt19937_64 random(53);
  ContactConstants constants = constants_of(1);
  constants.planes.clear();
  constants.boxes.clear();
  constants.balls.clear();
  State state(64);
  for (Slot s = 0; s < 64; ++s) {
    const auto x = static_cast<std::int32_t>(s) * 3 * kRadius;
    state.spawn(s, 0, 0, {{x, 0, -x}, vector_within(random, 100000)});
    state.c(1)[s] = 77;
  }
  State expected = state;
  const auto ballistic = *make_predictor("ballistic", 64, {});
  predictor_of("contact", 64, constants)->step(state, state, kFalling);
  ballistic->step(expected, expected, kFalling);
  EXPECT_EQ(state, expected);
}

TEST_P(ContactTiers, ABodyOnThePlaneComesToRest) {
  const auto predictor = predictor_of(GetParam(), 1, constants_of(1));
  State state(1);
  state.spawn(0, 0, 0, {{0, 3 * kRadius, 0}, {}});
  for (int frame = 0; frame < 600; ++frame) predictor->step(state, state, kFalling);
  EXPECT_NEAR(state.p(1)[0], kRadius, kRadius / 20.0);
  EXPECT_NEAR(state.v(1)[0], 0, 300);
}

TEST_P(ContactTiers, ABodyAtRestStaysWhereItIsAndOthersFeelIt) {
  for (const std::int32_t substeps : {1, 3}) {
    const auto predictor = predictor_of(GetParam(), 2, constants_of(substeps));
    State state(2);
    // In mid-air, and another that falls on it.
    state.spawn(0, 0, 0, {{0, 50 * kRadius, 0}, {}});
    state.spawn(1, 0, 0, {{0, 53 * kRadius, 0}, {}});
    for (std::size_t i = 0; i < 3; ++i) state.c(i)[0] = -kFalling.drive.gravity[i];
    state.rest()[0] = 1;
    for (int frame = 0; frame < 100; ++frame) {
      const State before = state;
      predictor->step(before, state, kFalling);
      State in_place = before;
      predictor->step(in_place, in_place, kFalling);
      ASSERT_EQ(in_place, state);
      ASSERT_EQ(state.p(1)[0], 50 * kRadius);
      ASSERT_EQ(state.rest()[0], 1);
      ASSERT_EQ(state.c(1)[0], -kFalling.drive.gravity[1]);
    }
    EXPECT_GT(state.p(1)[1], 51 * kRadius);
    StepInput tilted = kFalling;
    tilted.drive.gravity[0] = 1;
    predictor->step(state, state, tilted);
    EXPECT_EQ(state.rest()[0], 0);
  }
}

TEST_P(ContactTiers, AMixedRunKeepsItsHash) {
  const auto predictor = predictor_of(GetParam(), 200, constants_of(2));
  State state(200);
  std::uint32_t x = 1;
  const auto next = [&x](std::int32_t limit) {
    x = x * 1664525U + 1013904223U;
    return static_cast<std::int32_t>((x >> 8U) % (2 * static_cast<std::uint32_t>(limit))) - limit;
  };
  for (Slot s = 0; s < 200; ++s) {
    const Vec3i p{next(8 * kRadius), next(3 * kRadius) + 4 * kRadius, next(4 * kRadius)};
    state.spawn(s, 0, static_cast<TypeId>(s % 2), {p, {next(99999), next(99999), next(99999)}});
  }
  for (int frame = 0; frame < 50; ++frame) predictor->step(state, state, kFalling);
  StateHasher hasher;
  EXPECT_EQ(to_hex(hasher.hash(state, {})), GetParam() == "field" ? "af8e47babf2ececf" : "34c4d42564047433");
}

// The results of the kernels: the pairs of a heap in a grid of 8 cells a side, and the forces between them.
struct KernelResult {
  std::vector<std::uint32_t> first, second;
  std::vector<std::int32_t> forces;
  friend bool operator==(const KernelResult&, const KernelResult&) = default;
};

KernelResult run_kernels(const ContactKernels& kernels, std::uint64_t seed, std::int32_t spread,
                         bool later_too) {
  std::mt19937_64 random(seed);
  constexpr std::uint32_t kSideBits = 3, kCells = 1U << (3 * kSideBits), kBeyond = 8;
  std::vector<std::uint32_t> begin{0}, cells;
  for (std::uint32_t cell = 0; cell < kCells; ++cell) {
    const auto in_cell = random() % 50 == 0 ? ContactGrid::kMaxInCell : random() % 3;
    begin.push_back(begin.back() + static_cast<std::uint32_t>(in_cell));
    cells.resize(begin.back(), cell);
  }
  const std::uint32_t count = begin.back();
  std::vector<std::uint32_t> xy(count + kBeyond), later(xy), z(xy);
  std::vector<ContactTouch> touches(count);
  for (std::uint32_t place = 0; place < count; ++place) {
    xy[place] = static_cast<std::uint32_t>(random());
    later[place] = static_cast<std::uint32_t>(random());
    z[place] = static_cast<std::uint32_t>(random()) & (later_too ? ~0U : 0xFFFFU);
    ContactView& view = touches[place].view;
    for (std::size_t i = 0; i < 3; ++i) {
      view.q[i] = static_cast<std::int16_t>(vector_within(random, spread)[i]);
      view.v[i] = static_cast<std::int16_t>(vector_within(random, (1 << 14) - 1)[i]);
    }
    if (place > 0 && random() % 20 == 0) view.q = touches[place - 1].view.q;
    view.radius = random() % 3 == 0 ? 0 : (1 << 13) - 1;  // 0: far smaller than the largest
  }
  std::vector<std::uint32_t> inverse_root(1U << 12U);
  for (std::uint32_t& x : inverse_root) x = 65536 + static_cast<std::uint32_t>(random() % (1U << 15U));

  const ContactGrid grid{{kSideBits, 2 * kSideBits, 3 * kSideBits}, begin.data(), cells.data(), xy.data(),
                         later_too ? later.data() : nullptr,        z.data(),     1U << 29U};
  constexpr std::uint32_t kAtOnce = 500, kRoom = 1U << 16U;
  std::vector<std::uint32_t> first(kRoom), second(kRoom);
  ContactPairs pairs{first.data(), second.data(), 0};
  for (std::uint32_t place = 0; place < count;)
    place = kernels.find(grid, place, pairs.count + kAtOnce, pairs);
  EXPECT_LT(pairs.count + ContactPairs::kMaxAtOnce + ContactPairs::kBatch, kRoom);
  KernelResult result;
  result.first.assign(first.begin(), first.begin() + pairs.count);
  result.second.assign(second.begin(), second.begin() + pairs.count);
  for (; pairs.count % ContactPairs::kBatch != 0; ++pairs.count) first[pairs.count] = second[pairs.count] = 0;
  kernels.add_forces({3641, 820, 410, 2}, inverse_root.data(), pairs, touches.data());
  for (const ContactTouch& touch : touches)
    result.forces.insert(result.forces.end(), touch.force.f.begin(), touch.force.f.end());
  return result;
}

// A lattice full of bodies of radius 1, in the smallest grid: an overflow would not compile.
static_assert(times_covered({(1 << 29) + 2, (1 << 29) + 2, (1 << 29) + 2}, {2, 4, 6}) == std::int64_t{1}
                                                                                             << 60);
static_assert(times_covered({40, 40, 2}, {5, 10, 15}) == 20 * 20 * 16);

TEST(Contact, TheFastestKernelsEqualThePortableOnes) {
  for (const std::uint64_t seed : {71U, 72U, 73U}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    for (const bool later : {false, true}) {
      for (const std::int32_t spread : {0, 1 << 13, 1 << 14, 1 << 15}) {
        const KernelResult portable = run_kernels(portable_contact_kernels(), seed, spread, later);
        EXPECT_GT(portable.first.size(), 1000U);
        EXPECT_EQ(run_kernels(fastest_contact_kernels(), seed, spread, later), portable);
      }
    }
  }
}

TEST(Contact, WallsPushManyBodiesAsEachOfThemAlone) {
  constexpr std::uint64_t kSeed = 74;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  constexpr std::size_t kCount = 300;
  const ContactConstants constants = constants_of(1);
  const ContactWalls walls(constants, {3641, 820, 410, 2}, kRadius);
  std::vector<ContactBody> bodies(kCount);
  std::vector<ContactForce> forces(kCount);
  for (std::size_t k = 0; k < kCount; ++k) {
    bodies[k] = {vector_within(random, 15 * kRadius), kRadius, vector_within(random, 100000), 0};
    // Blocks that no shape meets, too.
    if (k / 64 % 2 == 1) bodies[k].p[1] += 30 * kRadius;
  }
  walls.add_forces(bodies, forces);
  std::size_t touching = 0;
  for (std::size_t k = 0; k < kCount; ++k) {
    ContactForce alone{};
    walls.add_forces(std::span(bodies).subspan(k, 1), std::span(&alone, 1));
    EXPECT_EQ(forces[k].f, alone.f) << "body " << k;
    touching += alone.f != Vec3i{} ? 1U : 0U;
  }
  EXPECT_GT(touching, 50U);
  EXPECT_LT(touching, kCount - 50U);
}

TEST(Contact, ConstantsReadBackAsTheyWereWritten) {
  const auto values = write_contact_constants(constants_of(2));
  const auto read = read_contact_constants(values);
  ASSERT_TRUE(read);
  EXPECT_EQ(write_contact_constants(*read), values);
}

TEST_P(ContactTiers, BadConstantsAreRefused) {
  const auto good = write_contact_constants(constants_of(2));
  const auto refused = [](std::span<const std::int32_t> values) {
    const auto made = make_predictor(GetParam(), 10, values);
    return !made && made.error().code == ErrorCode::kMalformed;
  };
  for (std::size_t size = 0; size < good.size(); ++size) EXPECT_TRUE(refused(std::span(good).first(size)));
  auto longer = good;
  longer.push_back(0);
  EXPECT_TRUE(refused(longer));
  for (std::size_t i = 0; i < good.size(); ++i) {
    auto bad = good;
    bad[i] = INT32_MIN;
    EXPECT_TRUE(refused(bad)) << "value " << i;
  }
  EXPECT_FALSE(make_predictor(GetParam(), 0, good));
  EXPECT_FALSE(make_predictor(GetParam(), kMaxCapacity + 1, good));
}

}  // namespace
}  // namespace tandem
