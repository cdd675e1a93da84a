#include "sdk/core/codec/tracker/memory.hpp"

#include <algorithm>
#include <bit>

#include "sdk/core/codec/tracker/filter_run.hpp"
#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

// Corrected and renewed bodies are younger than the others afterwards: their age restarts at zero.
constexpr std::uint8_t kYoungest = 0xFF;

// Codes models in a snapshot: the weight of each as its difference to 256 (most used models lack one), and of
// each used model the number of ones that explains its probability, and what is left.
class ModelsCoder {
 public:
  /// `start`: P of a model that has learned nothing. Returns false if a decoder read an invalid model.
  template <class Coder>
  bool code(Coder& coder, std::uint16_t start, std::uint8_t& weight, std::uint16_t& p1) {
    const std::int64_t lacks = number(coder, kinds_[kWeights], static_cast<std::uint8_t>(0U - weight));
    if (lacks < 0 || lacks > UINT8_MAX) return false;
    weight = static_cast<std::uint8_t>(-lacks);
    if (weight == 0) return true;
    // A model that has seen `ones` among `weight` decisions has about this P.
    const std::int64_t count = weight + 1;
    const std::int64_t seen = (count * p1 - start + (1 << 15)) >> 16;
    const std::int64_t ones = number(coder, kinds_[kOnes + std::bit_width(unsigned{weight}) - 1], seen);
    const std::int64_t guess =
        std::clamp<std::int64_t>((start + ones * 65536) / count, TrackerModels::kLeast, TrackerModels::kMax);
    const std::int64_t p = guess + number(coder, kinds_[kRounding], p1 - guess);
    p1 = static_cast<std::uint16_t>(p);
    return p >= TrackerModels::kLeast && p <= TrackerModels::kMax;
  }

 private:
  // Not inline: three copies would make the WebAssembly module larger, and there are few models.
  template <class Coder>
  [[gnu::noinline]] static std::int64_t number(Coder& coder, NumberModels& models, std::int64_t x) {
    return code_number(coder, models, x);
  }

  enum : std::size_t { kWeights, kRounding, kOnes, kKinds = kOnes + 8 };  // ones by the bits of the weight
  // In a vector, because compilers unroll the start values of an array into 20 kB of code.
  std::vector<NumberModels> kinds_ = std::vector<NumberModels>(kKinds);
};

}  // namespace

std::span<const Slot> TrackerDelta::join(std::uint32_t capacity) {
  TrackerCounts* sum = nullptr;
  std::uint32_t count = 0;
  TANDEM_ASSERT(capacity == slots.size());
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    Part& part = blocks[b];
    TANDEM_ASSERT(part.corrected <= block_at(b, capacity).slots);
    part.first = count;
    if (part.corrected == 0) continue;
    if (const Slot from = block_at(b, capacity).first; from != count)
      std::copy_n(slots.data() + from, part.corrected, slots.data() + count);
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

TrackerMemory::TrackerMemory(const CodecSetup& setup)
    : capacity_(setup.capacity),
      radii_(setup.radii.begin(), setup.radii.end()),
      columns_((turns() ? 2 : 1) * kColumns * setup.capacity),
      numbers_(block_count(setup.capacity), 1),
      silent_(block_count(setup.capacity)),
      history_(setup.capacity),
      youngest_(turns() ? setup.capacity : 0),
      gains_(setup.tracker) {}

void TrackerMemory::write(std::size_t column, Slot slot, const TrackerBody& body) {
  std::byte* at = columns_.data() + column * capacity_ + slot;
  *at = static_cast<std::byte>(body.age);
  *(at += capacity_) = static_cast<std::byte>(body.interval);
  for (const std::int32_t step : body.steps) *(at += capacity_) = static_cast<std::byte>(step);
}

void TrackerMemory::derive(Slot slot) {
  const TrackerBody body = turns() ? merged(this->body(slot), turn(slot)) : this->body(slot);
  history_[slot] = flag_history(body);
  if (turns()) youngest_[slot] = static_cast<std::uint8_t>(body.age);
}

void TrackerMemory::apply(const TrackerDelta& delta, const Corrections& corrections,
                          const RunBlocks& run_blocks, State& state) {
  TANDEM_ASSERT(state.capacity() == capacity_ && state.groups().orientation == turns());
  gains_.set(corrections.parameters.velocity_gain, corrections.parameters.acceleration_gain);
  for (const Slot slot : corrections.renewed) {
    write(0, slot, {});
    if (turns()) write(kColumns, slot, {});
    derive(slot);
  }
  for_each_tracker_block(capacity_, run_blocks,
                         [&](const Block& block) { apply(delta, corrections, block, state); });
  if (delta.seen != nullptr) models_.learn(*delta.seen, models_in_use());
}

void TrackerMemory::correct_position(const TrackerFilter& filter, const TrackerCorrection& correction,
                                     Slot slot, State& state) {
  TrackerBody body = this->body(slot);
  filter.move(state, slot, correction, body);
  filter.settle(state, slot, correction.rest);
  history_[slot] = flag_history(body);
  write(0, slot, body);
  columns_[slot] = std::byte{kYoungest};
}

void TrackerMemory::correct_positions(const TrackerFilter& filter, const TrackerDelta& delta,
                                      const Block& block, State& state) {
  const TrackerDelta::Part& part = delta.blocks[block.index];
  const std::span<const Slot> slots = std::span(delta.slots).subspan(part.first, part.corrected);
  TANDEM_ASSERT(slots.empty() || (slots.front() >= block.first && slots.back() < block.first + block.slots));
  const TrackerCorrection* const corrections = delta.corrections.data() + block.first;
  const auto correct = [&](std::size_t i) { correct_position(filter, corrections[i], slots[i], state); };
  std::size_t next = 0;
  if (part.corrected < FilterRun::kFewest) {
    for (; next < slots.size(); ++next) correct(next);
    return;
  }
  const FilterRun run(filter, gains_);
  auto* const bytes = reinterpret_cast<std::uint8_t*>(columns_.data());
  for (Slot first = block.first; next < slots.size(); first += FilterRun::kSlots) {
    const std::uint32_t count = std::min(FilterRun::kSlots, block.first + block.slots - first);
    const std::size_t begin = next;
    next = static_cast<std::size_t>(
        std::lower_bound(slots.begin() + static_cast<std::ptrdiff_t>(begin), slots.end(), first + count) -
        slots.begin());
    const bool together = run.fits() && count == FilterRun::kSlots && next - begin >= FilterRun::kFewest;
    for (std::size_t i = begin; i < next; ++i) {
      if (!together || !FilterRun::fits(corrections[i])) correct(i);
    }
    if (!together) continue;
    FilterColumns columns{.age = bytes + first,
                          .interval = bytes + capacity_ + first,
                          .steps = {},
                          .history = history_.data() + first};
    for (std::size_t axis = 0; axis < 3; ++axis)
      columns.steps[axis] = reinterpret_cast<std::int8_t*>(bytes) + (2 + axis) * capacity_ + first;
    run.apply(slots.subspan(begin, next - begin), corrections + begin, first, count, columns, kYoungest,
              state);
  }
}

void TrackerMemory::correct_position_and_turn(const TrackerFilter& filter,
                                              const TrackerTurningCorrection& correction, Slot slot,
                                              State& state) {
  if (is_some(correction.steps)) {
    TrackerBody body = this->body(slot);
    filter.move(state, slot, correction, body);
    write(0, slot, body);
  }
  if (is_some(correction.turn)) {
    TrackerBody body = turn(slot);
    filter.turn(state, slot, correction, body);
    write(kColumns, slot, body);
  }
  filter.settle(state, slot, correction.rest);
  derive(slot);
  if (is_some(correction.steps)) columns_[slot] = std::byte{kYoungest};
  if (is_some(correction.turn)) columns_[kColumns * capacity_ + slot] = std::byte{kYoungest};
}

bool TrackerMemory::begin(const Block& block, bool is_silent) {
  std::uint8_t& frames = silent_[block.index];
  if (!is_silent) frames = 0;
  // A corrected body ages from 0 in the frame after its correction, and a loaded one from anything.
  if (frames == kMaxAge) return false;
  if (is_silent) ++frames;
  ++numbers_[block.index];
  return true;
}

void TrackerMemory::apply(const TrackerDelta& delta, const Corrections& corrections, const Block& block,
                          State& state) {
  const std::span<const Slot> renewed = within(corrections.renewed, block);
  if (!begin(block, delta.blocks[block.index].corrected == 0 && renewed.empty())) return;
  const TrackerFilter filter(corrections.parameters, corrections.gravity, corrections.rounding.p, gains_,
                             radii_);
  const TrackerDelta::Part& part = delta.blocks[block.index];
  if (turns()) {
    for (std::uint32_t i = 0; i < part.corrected; ++i)
      correct_position_and_turn(filter, delta.turning(block.first + i), delta.slots[part.first + i], state);
  } else {
    correct_positions(filter, delta, block, state);
  }
  grow_older(0, block, renewed, state);
  if (!turns()) return;
  grow_older(kColumns, block, renewed, state);
  const std::uint8_t* const turned = column(kColumns);
  for (Slot slot = block.first; slot < block.first + block.slots; ++slot)
    youngest_[slot] = std::min(column(0)[slot], turned[slot]);
}

void TrackerMemory::grow_older(std::size_t column, const Block& block, std::span<const Slot> renewed,
                               const State& state) {
  std::byte* const age = columns_.data() + column * capacity_;
  for (const Slot slot : renewed) age[slot] = std::byte{kYoungest};
  // 255 wraps to 0; an age of 254 stays 254.
  const std::uint8_t* const alive = state.alive().data();
  const Slot end = block.first + block.slots;
  for (Slot slot = block.first; slot < end; ++slot) {
    const auto was = std::to_integer<std::uint8_t>(age[slot]);
    const auto older = static_cast<std::uint8_t>(was + (was != kMaxAge - 1 ? 1 : 0));
    age[slot] = static_cast<std::byte>(alive[slot] != 0 ? older : 0);
  }
}

void TrackerMemory::save_models(NumberEncoder& out) const {
  ModelsCoder coder;
  const TrackerModels start;
  for (std::size_t i = 0; i < models_in_use(); ++i) {
    std::uint8_t weight = models_.weight[i];
    std::uint16_t p1 = models_.p1[i];
    coder.code(out, start.p1[i], weight, p1);
  }
}

std::size_t TrackerMemory::models_bits_bound() const {
  return models_in_use() *
         (most_number_bits(UINT8_MAX) + most_number_bits(2 * UINT8_MAX) + most_number_bits(UINT16_MAX));
}

Result<void> TrackerMemory::load(std::span<const std::byte> columns, NumberDecoder& in) {
  if (columns.size() != columns_.size())
    return fail(ErrorCode::kMalformed, "coder state of another number of columns");
  for (std::size_t group = 0; group < columns.size(); group += kColumns * capacity_) {
    const auto of_group = columns.subspan(group, kColumns * capacity_);
    if (std::any_of(of_group.begin(), of_group.begin() + capacity_,
                    [](std::byte age) { return std::to_integer<std::uint32_t>(age) >= kMaxAge; })) {
      return fail(ErrorCode::kMalformed, "coder state with an impossible age");
    }
    const auto steps = of_group.subspan(2 * std::size_t{capacity_});
    if (std::find(steps.begin(), steps.end(), std::byte{0x80}) != steps.end())
      return fail(ErrorCode::kMalformed, "coder state with a step of -128");
  }
  ModelsCoder coder;
  TrackerModels models;
  for (std::size_t i = 0; i < models_in_use(); ++i) {
    if (!coder.code(in, models.p1[i], models.weight[i], models.p1[i]))
      return fail(ErrorCode::kMalformed, "coder state with an impossible model");
  }
  if (!in.at_end()) return fail(ErrorCode::kMalformed, "coder state of wrong length");
  std::copy(columns.begin(), columns.end(), columns_.begin());
  for (Slot slot = 0; slot < capacity_; ++slot) derive(slot);
  for (std::uint64_t& number : numbers_) ++number;
  std::fill(silent_.begin(), silent_.end(), std::uint8_t{0});
  models_ = models;
  return {};
}

}  // namespace tandem
