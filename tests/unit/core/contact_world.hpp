#pragma once
// A small world with one of each shape, and bodies for it.

#include <cstdint>
#include <memory>
#include <random>
#include <string_view>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/predictor.hpp"
#include "sdk/core/tables/predictor_table.hpp"

namespace tandem {

inline constexpr std::int32_t kRadius = 20000;

inline ContactConstants constants_of(std::int32_t substeps) {
  ContactConstants constants;
  constants.substeps = substeps;
  constants.pair = {3641 / substeps, 410 / substeps, 410 / substeps};
  constants.wall = constants.pair;
  constants.types = {{kRadius, 65536}, {kRadius / 2, 131072}};
  constants.planes = {{{0, ContactConstants::kOne, 0}, 0}};
  constants.boxes = {
      {{200000, 0, 0},
       {50000, 50000, 50000},
       {{{ContactConstants::kOne, 0, 0}, {0, ContactConstants::kOne, 0}, {0, 0, ContactConstants::kOne}}}}};
  constants.balls = {{{-200000, 0, 0}, 60000}};
  return constants;
}

/// With the constants that a server announces for this predictor in a world of `constants`.
inline std::unique_ptr<Predictor> predictor_of(std::string_view name, std::uint32_t capacity,
                                               const ContactConstants& constants) {
  const bool one_step = (*find_predictor(name))->one_step;
  return *make_predictor(name, capacity,
                         write_contact_constants(one_step ? in_one_step(constants) : constants));
}

inline Vec3i vector_within(std::mt19937_64& random, std::int32_t limit) {
  Vec3i v{};
  for (std::int32_t& x : v)
    x = static_cast<std::int32_t>(random() % (2 * static_cast<std::uint64_t>(limit) + 1)) - limit;
  return v;
}

inline State bodies_within(std::mt19937_64& random, std::uint32_t capacity, std::int32_t p, std::int32_t v) {
  State state(capacity);
  for (Slot s = 0; s < capacity; ++s) {
    if (random() % 7 == 0) continue;
    const TypeId type = static_cast<TypeId>(random() % 3);  // one more than the constants know
    state.spawn(s, 0, type, {vector_within(random, p), vector_within(random, v)});
    for (std::size_t i = 0; i < 3; ++i) state.c(i)[s] = vector_within(random, v)[i];
  }
  return state;
}

inline constexpr StepInput kFalling{{{0, -3000, 0}, 200}, {800}};

}  // namespace tandem
