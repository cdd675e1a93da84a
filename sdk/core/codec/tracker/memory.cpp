#include "sdk/core/codec/tracker/memory.hpp"

#include <algorithm>

namespace tandem {
namespace {

// Models in a snapshot: each one's weight, as what it lacks of 256 (most that are used at all lack one), and
// the probability of one that is used, as how far it is from the one before.
class ModelsCoder {
 public:
  /// False: a decoder read what no model is.
  template <class Coder>
  bool code(Coder& coder, std::uint8_t& weight, std::uint16_t& p1) {
    const std::int64_t lacks = code_number(coder, weights_, static_cast<std::uint8_t>(0U - weight));
    if (lacks < 0 || lacks > UINT8_MAX) return false;
    weight = static_cast<std::uint8_t>(-lacks);
    if (weight == 0) return true;
    guess_ += code_number(coder, probabilities_, p1 - guess_);
    p1 = static_cast<std::uint16_t>(guess_);
    return guess_ >= TrackerModels::kLeast && guess_ <= TrackerModels::kMost;
  }

 private:
  NumberModels weights_, probabilities_;
  std::int64_t guess_ = 32768;
};

}  // namespace

std::span<const Slot> TrackerDelta::join(std::uint32_t capacity, bool of_all_blocks) {
  TrackerCounts* sum = nullptr;
  std::uint32_t count = 0;
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    Part& part = blocks[b];
    part.first = count;
    if (part.corrected == 0 && !of_all_blocks) continue;
    if (const Slot from = block_at(b, capacity).first; from != count) {
      std::copy_n(slots.begin() + from, part.corrected, slots.begin() + count);
      std::copy_n(corrections.begin() + from, part.corrected, corrections.begin() + count);
    }
    count += part.corrected;
    if (sum == nullptr) {
      sum = &part.counts;
      continue;
    }
    for (std::size_t model = 0; model < sum->size(); ++model) {
      for (std::size_t bit = 0; bit < 2; ++bit) (*sum)[model][bit] += part.counts[model][bit];
    }
  }
  seen = sum;
  return std::span<const Slot>(slots).first(count);
}

TrackerMemory::TrackerMemory(std::uint32_t capacity, std::string_view predictor)
    : capacity_(capacity),
      columns_(kColumns * std::size_t{capacity}),
      history_(capacity),
      gains_(predictor) {}

void TrackerMemory::set_body(Slot slot, const TrackerBody& body) {
  std::byte* at = columns_.data() + slot;
  *at = static_cast<std::byte>(body.age);
  *(at += capacity_) = static_cast<std::byte>(body.interval);
  for (const std::int8_t step : body.steps) *(at += capacity_) = static_cast<std::byte>(step);
  history_[slot] = flag_history(body);
}

void TrackerMemory::apply(const TrackerDelta& delta, const Corrections& corrections,
                          const RunBlocks& run_blocks, State& state) {
  gains_.set(corrections.parameters.velocity_gain, corrections.parameters.acceleration_gain);
  for (const Slot slot : corrections.renewed) set_body(slot, {});
  for_each_tracker_block(capacity_, run_blocks,
                         [&](const Block& block) { apply(delta, corrections, block, state); });
  if (delta.seen != nullptr) models_.learn(*delta.seen);
}

void TrackerMemory::apply(const TrackerDelta& delta, const Corrections& corrections, const Block& block,
                          State& state) {
  const TrackerFilter filter(corrections.parameters, corrections.gravity, corrections.position_bits, gains_);
  // Corrected and renewed bodies are younger than the others afterwards: they start again from zero.
  constexpr std::byte kYoungest{0xFF};
  std::byte* const age = columns_.data();
  const TrackerDelta::Part& part = delta.blocks[block.index];
  for (std::uint32_t i = part.first; i < part.first + part.corrected; ++i) {
    const Slot slot = delta.slots[i];
    TrackerBody body = this->body(slot);
    filter.correct(state, slot, delta.corrections[i], body);
    set_body(slot, body);
    age[slot] = kYoungest;
  }
  const Slot end = block.first + block.slots;
  const std::span<const Slot> renewed = corrections.renewed;
  auto at = std::lower_bound(renewed.begin(), renewed.end(), block.first);
  for (; at != renewed.end() && *at < end; ++at) age[*at] = kYoungest;
  // 255 wraps to 0; what was 254 stays there.
  const std::uint8_t* const alive = state.alive().data();
  for (Slot slot = block.first; slot < end; ++slot) {
    const auto was = std::to_integer<std::uint8_t>(age[slot]);
    const auto older = static_cast<std::uint8_t>(was + (was != kMostAge - 1 ? 1 : 0));
    age[slot] = static_cast<std::byte>(alive[slot] != 0 ? older : 0);
  }
}

void TrackerMemory::save_models(NumberEncoder& out) const {
  ModelsCoder coder;
  for (std::size_t i = 0; i < TrackerModelIndex::kCount; ++i) {
    std::uint8_t weight = models_.weight[i];
    std::uint16_t p1 = models_.p1[i];
    coder.code(out, weight, p1);
  }
}

std::size_t TrackerMemory::models_bits_bound() {
  return TrackerModelIndex::kCount * (most_number_bits(UINT8_MAX) + most_number_bits(UINT16_MAX));
}

Result<void> TrackerMemory::load(std::span<const std::byte> columns, NumberDecoder& in) {
  if (columns.size() != columns_.size())
    return fail(ErrorCode::kMalformed, "coder state of another number of columns");
  if (std::any_of(columns.begin(), columns.begin() + capacity_,
                  [](std::byte age) { return std::to_integer<std::uint32_t>(age) >= kMostAge; })) {
    return fail(ErrorCode::kMalformed, "coder state with an impossible age");
  }
  const auto steps = columns.subspan(2 * std::size_t{capacity_});
  if (std::find(steps.begin(), steps.end(), std::byte{0x80}) != steps.end())
    return fail(ErrorCode::kMalformed, "coder state with a step of -128");
  ModelsCoder coder;
  TrackerModels models;
  for (std::size_t i = 0; i < TrackerModelIndex::kCount; ++i) {
    if (!coder.code(in, models.weight[i], models.p1[i]))
      return fail(ErrorCode::kMalformed, "coder state with an impossible model");
  }
  if (!in.at_end()) return fail(ErrorCode::kMalformed, "coder state of wrong length");
  std::copy(columns.begin(), columns.end(), columns_.begin());
  for (Slot slot = 0; slot < capacity_; ++slot) history_[slot] = flag_history(body(slot));
  models_ = models;
  return {};
}

}  // namespace tandem
