#pragma once
// The models of section 0x8b. They learn at once, so that a frame with many changes is cheap from its first
// bodies on.

#include <array>
#include <cstddef>

#include "sdk/core/codec/numbers.hpp"
#include "sdk/core/layout/data_fields.hpp"

namespace tandem {

struct DataModels {
  static constexpr std::size_t kAges = 15;     ///< buckets of data_age
  static constexpr std::size_t kNumbers = 16;  ///< at most so many numbers has a record

  std::array<LearningModel, 2> any;              ///< does a body of the block change? By the block before
  std::array<LearningModel, 2 * kAges> changed;  ///< does this body? By its age and the body before
  std::array<LearningModel, 2 * kMaxDataFields> field;  ///< does this field? By those before
  std::array<NumberModels, kNumbers> numbers;           ///< by how much
};

/// Visits the models that fields with so many numbers use, in the order of snapshots.
template <class Models, class Visit>
void for_each_model(Models& models, std::size_t numbers, const Visit& visit) {
  for (auto& model : models.any) visit(model);
  for (auto& model : models.changed) visit(model);
  for (auto& model : models.field) visit(model);
  for (std::size_t i = 0; i < numbers; ++i) {
    auto& number = models.numbers[i];
    visit(number.some);
    for (auto& model : number.length) visit(model);
    for (auto& model : number.sign) visit(model);
    for (auto& of_length : number.next)
      for (auto& model : of_length) visit(model);
  }
}

}  // namespace tandem
