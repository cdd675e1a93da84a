// Every predictor steps every world to the same bits with the kernels of every machine.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "sdk/core/predict/contact/contact.hpp"
#include "sdk/core/predict/hard/hard.hpp"
#include "sdk/core/predict/rigid/rigid.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "tests/support/worlds/worlds.hpp"
#include "tests/unit/core/machines.hpp"

namespace tandem::worlds {
namespace {

using Predictors = std::vector<std::unique_ptr<Predictor>>;

// With the fastest kernels of this machine first.
Predictors on_machines(const Layout& layout) {
  Predictors all;
  all.push_back(*make_predictor(layout.predictor, layout.capacity, layout.predictor_constants));
  const std::uint32_t capacity = layout.capacity;
  if (layout.predictor == "rigid") {
    const RigidConstants constants = *read_rigid_constants(layout.predictor_constants);
    const auto add = [&](const RigidPairKernels& pairs, const RigidKernels& solver) {
      all.push_back(std::make_unique<Rigid>(capacity, constants, RigidMachine{pairs, solver}));
    };
    add(portable_rigid_pair_kernels(), portable_rigid_kernels());
    add(rigid_pair_by_pair(), rigid_one_by_one());
  } else if (layout.predictor != "ballistic") {
    const ContactConstants constants = *read_contact_constants(layout.predictor_constants);
    const auto portable = portable_contact_kernels();
    if (layout.predictor == "hard") {
      for (const HardKernels& solver : {portable_hard_kernels(), hard_one_by_one()}) {
        all.push_back(
            std::make_unique<Hard>(capacity, constants, HardMachine{portable, portable_hard_meet(), solver}));
      }
    } else {
      all.push_back(std::make_unique<Contact>(capacity, constants, portable));
    }
  }
  return all;
}

State start_of(const World& world, const Predictor& predictor) {
  State state = world.start;
  state.keep_for_predictor(predictor.own_bytes());
  return state;
}

void expect_the_same_bits(const World& world) {
  SCOPED_TRACE(world.name);
  const Predictors machines = on_machines(world.layout);
  std::vector<State> states;
  for (const auto& machine : machines) states.push_back(start_of(world, *machine));
  bool any_moved = false;
  for (Frame frame = 0; frame < kFrames; ++frame) {
    const State before = states.front();
    for (std::size_t i = 0; i < machines.size(); ++i)
      machines[i]->step(states[i], states[i], input_at(world, frame));
    any_moved |= states.front() != before;
    for (std::size_t i = 1; i < machines.size(); ++i)
      ASSERT_TRUE(states[i] == states.front()) << "machine " << i << ", frame " << frame;
  }
  EXPECT_TRUE(any_moved);
}

TEST(Worlds, AreSteppedToTheSameBitsByAllMachines) {
  for (const World& world : all_worlds()) expect_the_same_bits(world);
}

TEST(Worlds, TellHowManyBodiesPassThroughOthersBecauseOneIsLarge) {
  for (const char* const name : {"field", "contact", "hard", "rigid"}) {
    for (const World& world : worlds_for(name, std::string_view(name) == "rigid")) {
      const auto predictor = *make_predictor(name, world.layout.capacity, world.layout.predictor_constants);
      EXPECT_EQ(predictor->crowded(), 0U);
      State state = start_of(world, *predictor);
      predictor->step(state, state, input_at(world, 0));
      SCOPED_TRACE(world.name);
      const bool roomy = world.name.ends_with("_wall") || world.name.ends_with("_row_x");
      if (roomy) {
        EXPECT_EQ(predictor->crowded(), 0U);
      } else if (world.name.ends_with("beside_a_giant")) {
        EXPECT_GT(predictor->crowded(), 10U);
      }
    }
  }
}

TEST(Lanes, AnInverseNearOneIsRoundedDownInASingleLaneAsInAVector) {
  for (std::int32_t x = 1 << 12; x <= 1 << 13; ++x) {
    const std::int32_t inverse = (1 << 24) / x;
    ASSERT_EQ(inverse_near_one(OneLane{x}).x, inverse) << x;
    ASSERT_EQ(inverse_near_one(same(x))[0], inverse) << x;
  }
}

// Code for single lanes and for vectors cannot compute with a comparison, which is 1 in one and -1 in the
// other.
template <class V>
concept AddsTruth = requires(V x) {
  x + (x < x);
};
static_assert(!AddsTruth<OneLane> && !AddsTruth<OneWordLane>);
template <class W>
concept AddsMask = requires(typename RigidBoxes<W>::Word x) {
  x + (x < x);
};
static_assert(!AddsMask<OneWord> && !AddsMask<EightWords>);

}  // namespace
}  // namespace tandem::worlds
