#include "sdk/core/codec/tracker/tracker.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/codec/tracker/search.hpp"
#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

constexpr std::size_t kModelBytes = 3;
constexpr std::size_t kTrackerBlockHeaderBytes = 2;

}  // namespace

Tracker::Tracker(const CodecSetup& setup)
    : capacity_(setup.capacity),
      bodies_(kColumns * std::size_t{capacity_}),
      history_(capacity_),
      run_(setup.run_blocks),
      flags_(capacity_),
      contexts_(capacity_),
      corrected_(capacity_),
      steps_(capacity_),
      work_(block_count(capacity_)),
      gains_(setup.predictor) {
  renewed_.reserve(capacity_);
}
Tracker::~Tracker() = default;

std::size_t Tracker::bound() const {
  return block_count(capacity_) * (kSectionHeaderBytes + kTrackerBlockHeaderBytes + kTrackerSlackBytes) +
         kMostTrackerBytesPerBody * capacity_;
}

void Tracker::set_body(Slot slot, const TrackerBody& body) {
  column(0)[slot] = static_cast<std::byte>(body.age);
  column(1)[slot] = static_cast<std::byte>(body.interval);
  for (std::size_t i = 0; i < 3; ++i) column(2 + i)[slot] = static_cast<std::byte>(body.steps[i]);
  history_[slot] = flag_history(body);
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
  use(parameters);
  search_->encode(*this, target, budget, out);
  finish_frame(state, TrackerSteppings(threshold_));
  return static_cast<std::uint32_t>(count_);
}

void Tracker::begin() {
  predicted_ = nullptr;
  renewed_.clear();
  count_ = 0;
  next_block_ = 0;
  for (Work& work : work_) {
    work.stream = {};
    work.corrected = 0;
  }
}

Result<void> Tracker::parse(std::span<const std::byte> section, std::span<const std::uint8_t> alive,
                            const CodecParameters& parameters) {
  TANDEM_ASSERT(alive.size() == capacity_ && predicted_ != nullptr);
  use(parameters);
  alive_ = alive;
  ByteReader in(section);
  const std::uint32_t index = in.get<std::uint16_t>();
  if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated corrections section");
  if (index >= work_.size()) return fail(ErrorCode::kMalformed, "corrections of a block beyond the capacity");
  if (index < next_block_) return fail(ErrorCode::kMalformed, "blocks do not ascend");
  next_block_ = index + 1;
  work_[index].stream = in.get_bytes(in.remaining());
  if (work_[index].stream.empty()) return fail(ErrorCode::kMalformed, "corrections section without a body");
  return {};
}

Result<void> Tracker::parse_end() {
  for_each_block([this](const Block& block) {
    Work& work = work_[block.index];
    work.broken = work.stream.empty() ? nullptr : decode_block(block, work);
  });
  for (const Work& work : work_) {
    if (work.broken != nullptr) return fail(ErrorCode::kMalformed, work.broken);
  }
  return {};
}

void Tracker::list_flags(const Block& block, std::span<const std::uint8_t> alive, Work& work) {
  const Slot end = block.first + block.slots;
  list_flag_models(reinterpret_cast<const std::uint8_t*>(bodies_.data()) + block.first,
                   history_.data() + block.first, alive.data() + block.first,
                   std::span(flags_).subspan(block.first, block.slots));
  // By turns in the places of zeros and ones, because neighbours often have the same model and an addition
  // would wait for the one before.
  work.counts = {};
  for (Slot slot = block.first; slot < end; ++slot) ++work.counts[flags_[slot]][slot & 1U];
  for (auto& [zeros, ones] : work.counts) zeros += std::exchange(ones, 0);
  auto renewed = std::lower_bound(renewed_.begin(), renewed_.end(), block.first);
  for (; renewed != renewed_.end() && *renewed < end; ++renewed) {
    if (alive[*renewed] == 0) continue;
    --work.counts[flags_[*renewed]][0];
    flags_[*renewed] = static_cast<std::uint16_t>(flag_model(0, 0));
    ++work.counts[flags_[*renewed]][0];
  }
}

void Tracker::list_contexts(const Block& block, std::span<const Slot> slots) {
  std::array<const std::uint8_t*, kColumns> columns{};
  for (std::size_t i = 0; i < kColumns; ++i)
    columns[i] = reinterpret_cast<const std::uint8_t*>(bodies_.data()) + i * capacity_;
  // One takes as long as some twenty side by side.
  if (slots.size() < block.slots / 20) {
    for (const Slot slot : slots) contexts_.fill({block.index, slot, 1}, *predicted_, columns, threshold_);
  } else {
    contexts_.fill(block, *predicted_, columns, threshold_);
  }
  auto renewed = std::lower_bound(renewed_.begin(), renewed_.end(), block.first);
  for (; renewed != renewed_.end() && *renewed < block.first + block.slots; ++renewed)
    contexts_.renew(*renewed);
}

const char* Tracker::decode_block(const Block& block, Work& work) {
  list_flags(block, alive_, work);
  Slot* const corrected = corrected_.data() + block.first;
  const std::uint16_t* const flags = flags_.data();
  const std::uint16_t* const p1 = models_.p1.data();
  std::uint32_t count = 0;
  RangeDecoder range(work.stream);
  const Slot end = block.first + block.slots;
  // Bits are worth guessing where few bodies are corrected: here, where they have less than 0.8 bits each.
  if (work.stream.size() * 10 < block.slots) {
    for (Slot slot = block.first; slot < end; ++slot) {
      if (range.get(p1[flags[slot]])) corrected[count++] = slot;
    }
  } else {
    for (Slot slot = block.first; slot < end; ++slot) {
      corrected[count] = slot;
      count += static_cast<std::uint32_t>(range.get_masked(p1[flags[slot]]));
    }
  }
  for (std::uint32_t i = 0; i < count; ++i) work.count_one(flags[corrected[i]]);
  if (count == 0) return "corrections section without a body";
  list_contexts(block, std::span(corrected, count));
  TrackerDecoder coder{range, &models_, &work.counts};
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!code_steps(coder, contexts_.of(corrected[i]), steps_[block.first + i]))
      return "correction beyond any lattice";
  }
  if (!coder.range.at_end()) return "bytes after the code stream";
  work.corrected = count;
  return nullptr;
}

void Tracker::apply(State& state) { finish_frame(state, TrackerSteppings(threshold_)); }

void Tracker::finish_block(State& state, const Block& block, const TrackerSteppings& steppings) {
  // Corrected and renewed bodies are younger than the others afterwards: they start again from zero.
  std::byte* age = column(0).data();
  const std::uint8_t* alive = state.alive().data();
  for (std::uint32_t i = block.first; i < block.first + work_[block.index].corrected; ++i) {
    const Slot slot = corrected_[i];
    TrackerBody body = this->body(slot);
    if (evidence_ != nullptr) {
      add_evidence(body, steps_[i], {state.c(0)[slot], state.c(1)[slot], state.c(2)[slot]},
                   work_[block.index].evidence);
    }
    correct_body(state, slot, steps_[i], steppings, threshold_, gains_, body);
    set_body(slot, body);
    age[slot] = std::byte{0xFF};
  }
  const auto first = std::lower_bound(renewed_.begin(), renewed_.end(), block.first);
  for (auto at = first; at != renewed_.end() && *at < block.first + block.slots; ++at)
    age[*at] = std::byte{0xFF};
  // 255 wraps to 0; what was 254 stays there.
  const Slot end = block.first + block.slots;  // a local, as in mark_suspects()
  for (Slot slot = block.first; slot < end; ++slot) {
    const auto was = std::to_integer<std::uint8_t>(age[slot]);
    const auto older = static_cast<std::uint8_t>(was + (was != kMostAge - 1 ? 1 : 0));
    age[slot] = static_cast<std::byte>(alive[slot] != 0 ? older : 0);
  }
}

void Tracker::finish_frame(State& state, const TrackerSteppings& steppings) {
  for (const Slot slot : renewed_) set_body(slot, {});
  // A delta without corrections teaches that they are rare. Else a budget that not even one body fits,
  // because its flags seem likely, would never be met.
  const bool none =
      std::all_of(work_.begin(), work_.end(), [](const Work& work) { return work.corrected == 0; });
  if (none) for_each_block([&](const Block& block) { list_flags(block, state.alive(), work_[block.index]); });
  for_each_block([&](const Block& block) { finish_block(state, block, steppings); });
  // One list of all blocks, one sum of what they saw.
  Work* sum = nullptr;
  count_ = 0;
  for (std::uint32_t b = 0; b < work_.size(); ++b) {
    Work& work = work_[b];
    if (work.corrected == 0 && !none) continue;
    const auto first = corrected_.begin() + block_at(b, capacity_).first;
    std::copy(first, first + work.corrected, corrected_.begin() + static_cast<std::ptrdiff_t>(count_));
    count_ += work.corrected;
    work.corrected = 0;
    if (evidence_ != nullptr) evidence_->add(work.evidence);
    work.evidence = {};
    if (sum == nullptr) {
      sum = &work;
      continue;
    }
    for (std::size_t i = 0; i < work.counts.size(); ++i) {
      for (std::size_t bit = 0; bit < 2; ++bit) sum->counts[i][bit] += work.counts[i][bit];
    }
  }
  if (!none && account_ != nullptr) models_.account(sum->counts, *account_);
  if (sum != nullptr) models_.learn(sum->counts);
  predicted_ = nullptr;
  renewed_.clear();
}

// Snapshot: columns of all slots, then per model: weight, and where that is not zero the probability.
void Tracker::save(ByteWriter& out) const {
  out.put_bytes(bodies_);
  for (std::size_t i = 0; i < TrackerModelIndex::kCount; ++i) {
    out.put(models_.weight[i]);
    if (models_.weight[i] != 0) out.put(models_.p1[i]);
  }
}

std::size_t Tracker::save_bound() const { return bodies_.size() + TrackerModelIndex::kCount * kModelBytes; }

Result<void> Tracker::load(std::span<const std::byte> bytes, std::span<const std::uint8_t> alive) {
  ByteReader in(bytes);
  const std::span<const std::byte> bodies = in.get_bytes(bodies_.size());
  if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated coder state");
  if (std::any_of(bodies.begin(), bodies.begin() + capacity_,
                  [](std::byte age) { return std::to_integer<std::uint32_t>(age) >= kMostAge; })) {
    return fail(ErrorCode::kMalformed, "coder state with an impossible age");
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const bool impossible = i >= 2 * std::size_t{capacity_} && bodies[i] == std::byte{0x80};  // steps of -128
    if (impossible || (bodies[i] != std::byte{0} && alive[i % capacity_] == 0))
      return fail(ErrorCode::kMalformed, "coder state of a slot that cannot have it");
  }
  bool good = true;
  TrackerModels models;
  for (std::size_t i = 0; i < TrackerModelIndex::kCount; ++i) {
    models.weight[i] = in.get<std::uint8_t>();
    if (models.weight[i] == 0) continue;
    models.p1[i] = in.get<std::uint16_t>();
    good &= models.p1[i] >= TrackerModels::kLeast && models.p1[i] <= TrackerModels::kMost;
  }
  if (!good || !in.at_end()) return fail(ErrorCode::kMalformed, "coder state of wrong length or content");
  std::copy(bodies.begin(), bodies.end(), bodies_.begin());
  for (Slot slot = 0; slot < capacity_; ++slot) history_[slot] = flag_history(body(slot));
  models_ = models;
  begin();
  return {};
}

}  // namespace tandem
