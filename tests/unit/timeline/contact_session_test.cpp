#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <tuple>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/rigid/constants.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "tests/unit/timeline/session.hpp"

// A session whose predicted bodies interact: what was simulated ahead is simulated again as a whole.

namespace tandem {
namespace {

constexpr std::uint32_t kCapacity = 120;
constexpr std::int32_t kRadius = 2000;

Layout contact_layout(const char* predictor, std::uint32_t lead) {
  Layout layout = synthetic::layout_for("tracker", kCapacity, lead);
  ContactConstants constants;
  constants.pair = constants.wall = {3641, 410, 410};
  constants.types = {{kRadius, 65536}};
  constants.planes = {{{0, ContactConstants::kOne, 0}, 0}};
  layout.predictor = predictor;
  if ((*find_predictor(predictor))->hard_contacts)
    layout.parameters.step.contacts = {.listed = true, .friction = 800};
  layout.predictor_constants = write_contact_constants(constants);
  if ((*find_predictor(predictor))->reads_shapes) {
    layout.groups.push_back(kOrientationGroup);
    layout.radii.assign(layout.type_count, 2 * kRadius);
    layout.predictor_constants =
        write_rigid_constants({constants, {{Solid::Kind::kBox, {kRadius, kRadius / 2, kRadius}}}});
  }
  return layout;
}

State heap(std::mt19937_64& random, const Groups& groups) {
  State state(kCapacity, groups);
  for (Slot s = 0; s < kCapacity; ++s) {
    Vec3i p{};
    for (std::int32_t& x : p) x = static_cast<std::int32_t>(random() % (8 * kRadius));
    state.spawn(s, 0, 0, {p, {}});
  }
  return state;
}

class ContactSession : public testing::TestWithParam<std::tuple<const char*, std::uint32_t>> {};

TEST_P(ContactSession, ClientAndAheadFramesEqualTheServersPrediction) {
  constexpr std::uint64_t kSeed = 61;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  const auto [name, lead] = GetParam();
  const Layout layout = contact_layout(name, 2);
  auto server = synthetic::server_of(layout);
  auto client = synthetic::client_of(layout);
  State target = heap(random, groups_of(layout));
  server.start(0, target, {{0, -300, 0}, 200});
  ASSERT_TRUE(client.load(synthetic::snapshot_of(server), synthetic::kEpoch));
  const auto predictor = *make_predictor(name, kCapacity, layout.predictor_constants);
  target.keep_for_predictor(predictor->own_bytes());
  constexpr Drive kFalling{{0, -300, 0}, 200};
  std::uint32_t corrected = 0;
  for (int frame = 0; frame < 100; ++frame) {
    while (client.step(lead)) {
    }
    StepParameters exact = layout.parameters.step;
    exact.decay = 0;
    predictor->step(target, target, {kFalling, exact, layout.parameters.codec.threshold, kFalling.gravity});
    const Slot pushed = static_cast<Slot>(random() % kCapacity);
    target.p(0)[pushed] += 700;
    const auto result = server.advance(target, {}, kNoBudget);
    corrected += result.corrected;
    ASSERT_TRUE(synthetic::apply(client, result)) << "frame " << frame;
    ASSERT_EQ(client.state(client.applied()), server.state());
    State ahead = server.state();
    for (Frame f = client.applied() + 1; f <= client.now(); ++f) {
      const StreamParameters& in_force = server.parameters();
      predictor->step(ahead, ahead,
                      {server.drive(), in_force.step, in_force.codec.threshold, kFalling.gravity});
      ASSERT_EQ(client.state(f), ahead) << "frame " << f << " ahead";
    }
  }
  EXPECT_GE(corrected, 100U);
}

// What rests is neither moved nor copied, until something changes it.
TEST_P(ContactSession, ACrowdOfWhichMostRestsStaysTheServers) {
  constexpr std::uint64_t kSeed = 62;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  const auto [name, lead] = GetParam();
  constexpr std::uint32_t kMany = 1000;
  Layout layout = contact_layout(name, lead);
  layout.capacity = kMany;
  auto server = synthetic::server_of(layout);
  auto client = synthetic::client_of(layout);
  State target(kMany, groups_of(layout));
  for (Slot s = 0; s < kMany; s += 1 + s % 3) {
    const auto at = static_cast<std::int32_t>(s);
    target.spawn(s, 0, 0, {{at % 10 * 3 * kRadius, at / 100 * 3 * kRadius, at / 10 % 10 * 3 * kRadius}, {}});
    if (s % 100 == 0) continue;
    target.rest()[s] = 1;
    target.c(1)[s] = 300;
  }
  std::uint64_t input = 0;
  std::uint32_t most_at_rest = 0;
  server.start(0, target, {{0, -300, 0}, 200});
  ASSERT_TRUE(client.load(synthetic::snapshot_of(server), synthetic::kEpoch));
  for (int frame = 1; frame <= 120; ++frame) {
    if (frame == 100) {  // all wake
      const ScheduledDrive drive{++input, server.frame() + 2, {{0, -300, frame}, 200}};
      ASSERT_TRUE(server.schedule(drive));
      ASSERT_TRUE(client.schedule(drive));
    }
    while (client.step(lead)) {
    }
    if (frame % 3 == 0) {
      const Slot pushed = static_cast<Slot>(random() % kMany);
      if (target.alive()[pushed] != 0) target.p(0)[pushed] += 700;
    }
    if (frame == 70) {
      ASSERT_TRUE(client.load(synthetic::snapshot_of(server), synthetic::kEpoch));
    }
    const auto result = server.advance(target, {}, kNoBudget);
    ASSERT_TRUE(synthetic::apply(client, result)) << "frame " << frame;
    ASSERT_EQ(client.state(client.applied()), server.state()) << "frame " << frame;
    most_at_rest = std::max(most_at_rest, server.state().rest_count());
  }
  EXPECT_GT(most_at_rest, kMany / 4);
}

INSTANTIATE_TEST_SUITE_P(PredictorsAndLeads, ContactSession,
                         testing::Combine(testing::Values("contact", "field", "hard", "rigid"),
                                          testing::Values(0U, 1U, 2U)));

}  // namespace
}  // namespace tandem
