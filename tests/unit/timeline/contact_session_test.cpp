#include <gtest/gtest.h>

#include <random>
#include <tuple>

#include "sdk/core/predict/contact/constants.hpp"
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
  return layout;
}

State heap(std::mt19937_64& random) {
  State state(kCapacity);
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
  State target = heap(random);
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

INSTANTIATE_TEST_SUITE_P(PredictorsAndLeads, ContactSession,
                         testing::Combine(testing::Values("contact", "field", "hard"),
                                          testing::Values(0U, 1U, 2U)));

}  // namespace
}  // namespace tandem
