// The encoder's vector search must choose what its scalar twin chooses: bytes depend on it.
#include "sdk/core/codec/tracker/step_batch.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "sdk/core/codec/rounding.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

using synthetic::Random;

struct Body {
  Vec3i from{}, to{};
  bool rest = false;
  TrackerContext context;
};

TrackerModels learned_models(Random& random) {
  TrackerModels models;
  for (std::size_t i = 0; i < TrackerModelIndex::kCount; ++i)
    models.p1[i] = static_cast<std::uint16_t>(TrackerModels::kLeast + random.below(65536 - 64));
  return models;
}

std::uint32_t below(Random& random, std::uint32_t count) {
  return static_cast<std::uint32_t>(random.below(count));
}

Body random_body(Random& random, std::int32_t threshold) {
  Body body;
  // From a fraction of a step to lengths that need an escape; some at opposite ends of the lattice.
  const std::int32_t reach = std::min(kPositionLimit / 2, threshold << random.below(6));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    body.from[axis] = random.value(1 << 20);
    body.to[axis] = body.from[axis] + random.value(reach);
    if (random.one_in(500)) {
      body.from[axis] = kPositionLimit;
      body.to[axis] = -kPositionLimit;
    }
  }
  body.rest = random.one_in(4);
  TrackerContexts contexts(1);
  contexts.renew(0);
  body.context = contexts.of(0);
  body.context.zero = below(random, TrackerModelIndex::kShortAges * TrackerModelIndex::kIntervals);
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    body.context.sign[axis] += below(random, TrackerModelIndex::kIntervals);
    body.context.magnitude[axis] = below(random, TrackerModelIndex::kLasts * TrackerModelIndex::kRecents);
    body.context.moved_last[axis] = below(random, 2);
  }
  return body;
}

TEST(TrackerStepBatch, ChoosesWhatOneBodyAfterTheOtherGets) {
  Random random(7);
  for (const std::int32_t threshold : {1, 2, 300, 405, 406, 407, 1000, 4096, 16384, 16385, 1 << 20}) {
    for (const bool rounds : {false, true}) {
      TrackerCosts costs;
      costs.learn(learned_models(random));
      const TrackerSteppings steppings(threshold, rounds ? rounding_for(threshold).p : 0);
      const ErrorWorth moving(threshold, 14), at_rest(threshold, 40);
      std::vector<Body> bodies(10 * StepBatch::kMaxBodies + 17);
      for (Body& body : bodies) body = random_body(random, threshold);
      StepBatch batch(steppings, moving, at_rest, costs);
      for (std::size_t first = 0; first < bodies.size(); first += StepBatch::kMaxBodies) {
        const std::size_t end = std::min(first + StepBatch::kMaxBodies, bodies.size());
        for (std::size_t i = first; i < end; ++i) batch.add(bodies[i].from, bodies[i].to, bodies[i].rest);
        batch.run([&](std::uint32_t i) { return bodies[first + i].context; });
        for (std::size_t i = first; i < end; ++i) {
          const Body& body = bodies[i];
          TrackerSteps steps{};
          const bool inside = choose_steps(body.from, body.to, steppings, body.rest ? at_rest : moving, costs,
                                           body.context, steps);
          ASSERT_EQ(batch.inside(static_cast<std::uint32_t>(i - first)), inside) << threshold << ": " << i;
          ASSERT_EQ(batch.steps(static_cast<std::uint32_t>(i - first)), steps) << threshold << ": " << i;
        }
      }
    }
  }
}

}  // namespace
}  // namespace tandem
