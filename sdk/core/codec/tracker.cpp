#include "sdk/core/codec/tracker.hpp"

#include <algorithm>
#include <string>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/codec/tracker_search.hpp"
#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

constexpr std::size_t kModelBytes = 5;
constexpr std::size_t kTrackerBlockHeaderBytes = 2;
// The encoder keeps to this as to a budget. Bodies that all jump at once take about a third of it.
constexpr std::size_t kMostBytesPerBody = 24;
constexpr std::size_t kSlackBytes = 64;

}  // namespace

Tracker::Tracker(std::uint32_t capacity)
    : capacity_(capacity),
      bodies_(kColumns * std::size_t{capacity}),
      models_(block_count(capacity)),
      work_(block_count(capacity)),
      worked_(block_count(capacity)),
      corrected_(capacity),
      steps_(capacity) {
  renewed_.reserve(capacity);
}
Tracker::~Tracker() = default;

std::size_t Tracker::bound() const {
  return block_count(capacity_) * (kSectionHeaderBytes + kTrackerBlockHeaderBytes + kSlackBytes) +
         kMostBytesPerBody * capacity_;
}

void Tracker::set_body(Slot slot, const TrackerBody& body) {
  column(0)[slot] = static_cast<std::byte>(body.age);
  column(1)[slot] = static_cast<std::byte>(body.interval);
  for (std::size_t i = 0; i < 3; ++i) column(2 + i)[slot] = static_cast<std::byte>(body.steps[i]);
}

void Tracker::renew(const State& predicted, std::span<const Slot> slots) {
  predicted_ = &predicted;
  renewed_.assign(slots.begin(), slots.end());
}

std::uint32_t Tracker::encode(State& state, const State& target, const CodecParameters& parameters,
                              std::size_t budget, ByteWriter& out) {
  predicted_ = &state;
  if (!search_) search_ = std::make_unique<TrackerSearch>(capacity_);
  budget = std::min({budget, bound(), out.rest().size()});
  const TrackerSteppings steppings(parameters.threshold);
  search_->encode(*this, target, parameters.threshold, budget, out);
  threshold_ = parameters.threshold;
  finish_frame(state, steppings);
  return static_cast<std::uint32_t>(count_);
}

void Tracker::begin() {
  predicted_ = nullptr;
  renewed_.clear();
  count_ = 0;
  next_block_ = 0;
  std::fill(worked_.begin(), worked_.end(), std::uint8_t{0});
}

Result<void> Tracker::parse(std::span<const std::byte> section, std::span<const std::uint8_t> alive,
                            const CodecParameters& parameters) {
  TANDEM_ASSERT(alive.size() == capacity_ && predicted_ != nullptr);
  threshold_ = parameters.threshold;
  ByteReader in(section);
  const std::uint32_t index = in.get<std::uint16_t>();
  if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated corrections section");
  if (index >= block_count(capacity_))
    return fail(ErrorCode::kMalformed, "corrections of a block beyond the capacity");
  if (index < next_block_) return fail(ErrorCode::kMalformed, "blocks do not ascend");
  next_block_ = index + 1;
  return parse_block(block_at(index, capacity_), alive, in.get_bytes(in.remaining()));
}

Result<void> Tracker::parse_block(const Block& block, std::span<const std::uint8_t> alive,
                                  std::span<const std::byte> bytes) {
  TrackerModels& models = work_[block.index];
  models = models_[block.index];
  RangeDecoder coder(bytes);
  const std::size_t first = count_;
  std::size_t count = count_;
  std::uint32_t previous = 0;
  bool good = true;
  for_each_body(block, alive, [&](Slot slot, bool renewed, std::uint32_t flag) {
    previous = static_cast<std::uint32_t>(coder.code(false, models.flag[flag + previous]));
    if (previous == 0) return;
    RangeDecoder values = coder;  // a copy, so that the call leaves `coder` in registers
    good &= code_steps(values, models, context(slot, renewed, threshold_), steps_[count]);
    coder = values;
    corrected_[count++] = slot;
  });
  count_ = count;
  if (!good) return fail(ErrorCode::kMalformed, "correction beyond any lattice");
  if (!coder.at_end()) return fail(ErrorCode::kMalformed, "bytes after the code stream");
  if (count_ == first) return fail(ErrorCode::kMalformed, "corrections section without a body");
  worked_[block.index] = 1;
  return {};
}

void Tracker::apply(State& state) { finish_frame(state, TrackerSteppings(threshold_)); }

void Tracker::finish_frame(State& state, const TrackerSteppings& steppings) {
  for (const Slot slot : renewed_) set_body(slot, {});
  // Corrected and renewed bodies are younger than the others afterwards: they start again from zero.
  std::byte* age = column(0).data();
  const std::uint8_t* alive = state.alive().data();
  for (std::size_t i = 0; i < count_; ++i) {
    TrackerBody body = this->body(corrected_[i]);
    correct_body(state, corrected_[i], steps_[i], steppings, threshold_, *gains_, body);
    set_body(corrected_[i], body);
    age[corrected_[i]] = std::byte{0xFF};
  }
  for (const Slot slot : renewed_) age[slot] = std::byte{0xFF};
  // 255 wraps to 0; what was 254 stays there.
  const std::uint32_t slots = capacity_;  // a local, as in mark_suspects()
  for (std::uint32_t slot = 0; slot < slots; ++slot) {
    const auto was = std::to_integer<std::uint8_t>(age[slot]);
    const auto older = static_cast<std::uint8_t>(was + (was != kMostAge - 1 ? 1 : 0));
    age[slot] = static_cast<std::byte>(alive[slot] != 0 ? older : 0);
  }
  for (std::size_t b = 0; b < worked_.size(); ++b) {
    if (worked_[b] != 0) models_[b] = work_[b];
  }
  predicted_ = nullptr;
  renewed_.clear();
}

// Snapshot: columns of all slots, then per block and model: seen, and where that is not zero the averages.
void Tracker::save(ByteWriter& out) const {
  out.put_bytes(bodies_);
  for (const TrackerModels& models : models_) {
    TrackerModels::for_each(models, [&out](const AdaptiveBit& bit) {
      out.put(bit.seen);
      if (bit.seen == 0) return;
      out.put(bit.fast);
      out.put(bit.slow);
    });
  }
}

std::size_t Tracker::save_bound() const {
  return bodies_.size() + models_.size() * TrackerModels::kCount * kModelBytes;
}

Result<void> Tracker::load(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  const std::span<const std::byte> bodies = in.get_bytes(bodies_.size());
  if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated coder state");
  if (std::any_of(bodies.begin(), bodies.begin() + capacity_,
                  [](std::byte age) { return std::to_integer<std::uint32_t>(age) >= kMostAge; })) {
    return fail(ErrorCode::kMalformed, "coder state with an impossible age");
  }
  bool good = true;
  for (TrackerModels& models : work_) {
    TrackerModels::for_each(models, [&](AdaptiveBit& bit) {
      bit = {};
      bit.seen = in.get<std::uint8_t>();
      good &= bit.seen <= AdaptiveBit::kMostSeen;
      if (bit.seen == 0) return;
      bit.fast = in.get<std::uint16_t>();
      bit.slow = in.get<std::uint16_t>();
    });
  }
  if (!good || !in.at_end()) return fail(ErrorCode::kMalformed, "coder state of wrong length or content");
  std::copy(bodies.begin(), bodies.end(), bodies_.begin());
  models_ = work_;
  begin();
  return {};
}

}  // namespace tandem
