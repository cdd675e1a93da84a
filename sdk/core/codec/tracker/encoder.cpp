#include "sdk/core/codec/tracker/encoder.hpp"

#include <algorithm>

#include "sdk/core/codec/errors.hpp"
#include "sdk/core/codec/tracker/decision_list.hpp"
#include "sdk/core/codec/tracker/joint_steps.hpp"
#include "sdk/core/codec/tracker/step_batch.hpp"

namespace tandem {
namespace {

// A body within the threshold but beyond this share of it (in 1/256) is corrected early if the model half
// expects it anyway. The share is 0.85. At 0.8 bits grow by 1.4 % and the RMS error falls by a tenth; at 1 no
// body goes early (RESEARCH.md).
constexpr std::int64_t kEarlyShare = 218;
// The worth in bits of an error of one threshold. A body with a smaller error is wrong again later, so bits
// spent on it come back. With 9 bits fall by 0.8 % and the RMS error grows by 5 %; with 20 bits grow by 0.8
// %. The error of a body at rest stays, so it is worth more: its RMS error falls by 1.3 % for 0.2 % of the
// bits (RESEARCH.md).
constexpr std::uint64_t kErrorWorth = 14, kRestingErrorWorth = 40;
constexpr std::size_t kHeaderBytes = 1 + 2 + 1;  // estimated: type, length, block
// Under a budget: this share of it (1/64) may stay unused, and the sections are written at most this many
// times. If estimates mislead, the last times write half as many bodies.
constexpr std::size_t kSpareShare = 64;
constexpr std::uint32_t kMostWrites = 8, kMostEstimates = 4;
constexpr std::size_t kTooLarge = SIZE_MAX;
// In 1/256 bits: a byte, and a first guess of the cost of a body with its share of the flags.
constexpr std::int64_t kByte = std::int64_t{8} << 8U;
constexpr std::int64_t kGuessedCost = std::int64_t{16} << 8U;

Vec3i position(const State& state, Slot slot) {
  return {state.p(0)[slot], state.p(1)[slot], state.p(2)[slot]};
}

}  // namespace

TrackerEncoder::Worth::Worth(std::int32_t threshold)
    : moving(threshold, kErrorWorth), at_rest(threshold, kRestingErrorWorth) {}

TrackerEncoder::TrackerEncoder(const TrackerMemory& memory)
    : candidates_(memory.capacity()),
      parts_(block_count(memory.capacity())),
      waiting_(memory.capacity()),
      marks_(parts_.size() * kBlockSlots),
      stillness_(memory.capacity(), memory.radii()),
      suspects_(memory.capacity()) {
  const std::uint32_t capacity = memory.capacity();
  std::size_t bytes = 0;
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    parts_[b].first_byte = bytes;
    bytes += most_tracker_bytes_per_body(memory.turns()) * block_at(b, capacity).slots + kTrackerSlackBytes;
  }
  bytes_.resize(bytes);
  order_.reserve(capacity);
}

std::span<const Slot> TrackerEncoder::encode(const TrackerFrame& frame, const State& target,
                                             std::size_t budget, ByteWriter& out) {
  const std::size_t bound = tracker_bound(frame.memory.capacity(), frame.memory.turns());
  budget = std::min({budget, bound, out.rest().size()});
  costs_.learn(frame.memory.models());
  stillness_.begin(frame.at);
  // If bodies wait, the budget was too small in the previous frame and probably still is.
  const bool is_enough = !some_wait_ || budget >= bound;
  frame.for_each_block([&](const Block& block) {
    gather(frame, target, block);
    if (is_enough) choose(frame, target, block);
  });
  const bool all_fit =
      (is_enough && write(frame, true) <= budget) || write_most_urgent(frame, target, budget);
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    if (frame.delta.blocks[b].corrected == 0) continue;
    if (b + 1 == parts_.size()) {
      out.put(static_cast<std::uint8_t>(SectionType::kLastCorrections));
    } else {
      out.put(static_cast<std::uint8_t>(SectionType::kCorrections));
      out.put_leb128(leb128_bytes(b) + parts_[b].coded_bytes);
      out.put_leb128(b);
    }
    out.put_bytes(std::span(bytes_).subspan(parts_[b].first_byte, parts_[b].coded_bytes));
  }
  if (!all_fit || some_wait_) remember_waiting(frame);
  frame.for_each_block([&](const Block& block) { stillness_.remember(frame.at, target, block); });
  return frame.join();
}

template <class Found>
void TrackerEncoder::scan(const TrackerFrame& frame, const State& target, const Block& block,
                          std::int32_t early, const Found& found) {
  const State& predicted = frame.at.predicted;
  if (!frame.memory.turns()) {
    const std::span<std::uint8_t, kBlockSlots> marks(marks_.data() + std::size_t{block.index} * kBlockSlots,
                                                     kBlockSlots);
    for_each_beyond(predicted, target, block, early, marks, found);
    return;
  }
  for_each_surface_beyond(predicted, target, block, early, frame.memory.radii(),
                          [&](Slot slot, std::uint64_t error) { found(slot, error * error); });
}

void TrackerEncoder::gather(const TrackerFrame& frame, const State& target, const Block& block) {
  const Worth worth(frame.at.parameters.threshold);
  const auto early = static_cast<std::int32_t>((frame.at.parameters.threshold * kEarlyShare) >> 8);
  Candidate* const first = candidates_.data() + block.first;
  Slot* const slots = frame.delta.slots.data() + block.first;
  std::uint32_t count = 0;
  const auto consider = [&](Slot slot, std::uint64_t error) {
    const bool must = error > worth.moving.limit;
    if (!must && frame.memory.models().p1[frame.flag_of(slot)] <= frame.memory.gains().early()) return;
    slots[count] = slot;
    first[count++] = {error, slot, kNoCost, Candidate::Steps::kOpen, must, false, {}};
  };
  suspects_.find(
      frame.at, block, early, [&](const auto& found) { scan(frame, target, block, early, found); }, consider);
  frame.list_contexts(block, std::span(slots, count));
  parts_[block.index].candidates = count;
}

void TrackerEncoder::choose(const TrackerFrame& frame, const State& target, const Worth& worth,
                            Candidate& candidate) {
  const Slot slot = candidate.slot;
  TrackerCorrection& correction = candidate.correction;
  correction.rest = stillness_.is_still(frame.at, target, slot);
  const ErrorWorth& of_error = correction.rest ? worth.at_rest : worth.moving;
  const TrackerContext context = frame.scratch.contexts.of(slot);
  const std::int32_t threshold = frame.at.parameters.threshold;
  bool inside = false;
  if (frame.memory.turns()) {
    const BodyState from = frame.at.predicted.body(slot);
    const BodyState to = target.body(slot);
    const std::int32_t radius = frame.memory.radii()[target.type()[slot]];
    inside = choose_joint_steps({from, to, radius, threshold, frame.at.rounding}, of_error, costs_, context,
                                frame.turn_context_of(slot), correction);
  } else {
    inside = choose_steps(position(frame.at.predicted, slot), position(target, slot),
                          TrackerSteppings(threshold, frame.at.rounding.p), of_error, costs_, context,
                          correction.steps);
  }
  candidate.judge(inside);
}

void TrackerEncoder::choose(const TrackerFrame& frame, const State& target, const Block& block) {
  const Worth worth(frame.at.parameters.threshold);
  Candidate* const first = candidates_.data() + block.first;
  Candidate* const end = first + parts_[block.index].candidates;
  if (frame.memory.turns()) {
    for (Candidate* candidate = first; candidate != end; ++candidate) {
      if (candidate->state == Candidate::Steps::kOpen) choose(frame, target, worth, *candidate);
    }
    return;
  }
  const TrackerSteppings steppings(frame.at.parameters.threshold, frame.at.rounding.p);
  StepBatch batch(steppings, worth.moving, worth.at_rest, costs_);
  std::array<Candidate*, StepBatch::kMost> chosen{};
  const auto run = [&] {
    const std::uint32_t count = batch.size();
    batch.run([&](std::uint32_t i) { return frame.scratch.contexts.of(chosen[i]->slot); });
    for (std::uint32_t i = 0; i < count; ++i) {
      chosen[i]->correction.steps = batch.steps(i);
      chosen[i]->judge(batch.inside(i));
    }
  };
  for (Candidate* candidate = first; candidate != end; ++candidate) {
    if (candidate->state != Candidate::Steps::kOpen) continue;
    const Slot slot = candidate->slot;
    candidate->correction.rest = stillness_.is_still(frame.at, target, slot);
    chosen[batch.size()] = candidate;
    batch.add(position(frame.at.predicted, slot), position(target, slot), candidate->correction.rest);
    if (batch.is_full()) run();
  }
  run();
}

bool TrackerEncoder::write_most_urgent(const TrackerFrame& frame, const State& target, std::size_t budget) {
  rank(frame);
  const auto all = static_cast<std::uint32_t>(order_.size());
  bool may_all_fit = some_wait_;  // false: they were tried
  const auto try_all = [&] {
    may_all_fit = false;
    frame.for_each_block([&](const Block& block) { choose(frame, target, block); });
    return write(frame, true) <= budget;
  };
  if (all == 0 && may_all_fit && try_all()) return true;
  std::uint32_t fits = 0;
  std::uint32_t too_many = all + 1;
  std::uint32_t written = too_many;
  std::int64_t beyond = kByte;  // excess of the written size over the estimate
  for (std::uint32_t i = 0; i < kMostWrites && too_many - fits > 1; ++i) {
    std::uint32_t last = too_many - 1;
    if (i >= kMostEstimates) {
      last = fits + (too_many - fits) / 2;
      std::nth_element(order_.data() + fits, order_.data() + last, order_.data() + too_many - 1);
    }
    const Cut cut = this->cut(frame, target, fits, last, static_cast<std::int64_t>(budget) * kByte - beyond);
    if (cut.count == fits) break;
    if (cut.count == all && may_all_fit && try_all()) return true;
    written = cut.count;
    const std::size_t size_bytes = write_first(frame, written);
    (size_bytes <= budget ? fits : too_many) = written;
    if (size_bytes <= budget && budget - size_bytes <= budget / kSpareShare) break;
    if (size_bytes != kTooLarge)
      beyond = static_cast<std::int64_t>(size_bytes) * kByte - cut.cost + kByte / 2;
  }
  if (written != fits) write_first(frame, fits);
  return false;
}

void TrackerEncoder::rank(const TrackerFrame& frame) {
  frame.for_each_block([&](const Block& block) {
    TrackerDelta::Part& coded = frame.delta.blocks[block.index];
    frame.list_flags(block);
    // Finer than costs_, because there are many of them.
    std::uint64_t zeros = 0;
    for (std::uint32_t model = 0; model < TrackerModelIndex::kSteps; ++model) {
      if (coded.counts[model][0] == 0) continue;
      const std::uint32_t p0 = 65536U - frame.memory.models().p1[model];
      zeros += std::uint64_t{coded.counts[model][0]} * ((16U << 16U) - log2_of(p0, 16));
    }
    Part& part = parts_[block.index];
    part.cost = static_cast<std::int64_t>(zeros >> 8U) + static_cast<std::int64_t>(kHeaderBytes) * kByte;
    part.sent = 0;
  });
  order_.clear();
  constexpr std::uint64_t kMostError = (std::uint64_t{1} << 48U) - 1;  // so that the product fits
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    const std::uint32_t first = b * kBlockSlots;
    for (std::uint32_t i = first; i < first + parts_[b].candidates; ++i) {
      const Candidate& candidate = candidates_[i];
      const std::uint64_t frames = waiting_[candidate.slot] + 1U;
      if (candidate.must) order_.push_back({std::min(candidate.error, kMostError) * frames * frames, i});
    }
  }
}

std::int32_t TrackerEncoder::cost(const TrackerFrame& frame, const Candidate& candidate) const {
  const auto& flag = costs_.of[frame.flag_of(candidate.slot)];
  CostCoder coder{&costs_};
  TrackerCorrection correction = candidate.correction;
  frame.code(coder, candidate.slot, correction);
  return static_cast<std::int32_t>(coder.cost) + flag[1] - flag[0];
}

std::int64_t TrackerEncoder::add(const TrackerFrame& frame, const State& target, std::uint32_t first,
                                 std::uint32_t last) {
  const Worth worth(frame.at.parameters.threshold);
  std::int64_t sum = 0;
  for (std::uint32_t i = first; i < last; ++i) {
    const std::uint32_t index = order_[i].index;
    Candidate& candidate = candidates_[index];
    if (candidate.state == Candidate::Steps::kOpen) choose(frame, target, worth, candidate);
    if (candidate.state == Candidate::Steps::kUseless) continue;
    if (candidate.cost == kNoCost) candidate.cost = cost(frame, candidate);
    Part& part = parts_[index / kBlockSlots];
    sum += candidate.cost + (part.sent++ == 0 ? part.cost : 0);
  }
  return sum;
}

std::int64_t TrackerEncoder::remove(std::uint32_t first, std::uint32_t last) {
  std::int64_t sum = 0;
  for (std::uint32_t i = first; i < last; ++i) {
    const std::uint32_t index = order_[i].index;
    const Candidate& candidate = candidates_[index];
    if (candidate.state == Candidate::Steps::kUseless) continue;
    Part& part = parts_[index / kBlockSlots];
    sum += candidate.cost + (--part.sent == 0 ? part.cost : 0);
  }
  return sum;
}

TrackerEncoder::Cut TrackerEncoder::cut(const TrackerFrame& frame, const State& target, std::uint32_t first,
                                        std::uint32_t last, std::int64_t most) {
  for (Part& part : parts_) part.sent = 0;
  std::int64_t sum = add(frame, target, 0, first);
  bool is_limited = false;
  const auto guess = static_cast<std::uint32_t>(std::max<std::int64_t>(most / kGuessedCost, 16));
  while (first < last) {
    const std::uint32_t more = is_limited ? (last - first + 1) / 2 : std::max(first, guess);
    const std::uint32_t tried = first + std::min(more, last - first);
    std::nth_element(order_.data() + first, order_.data() + tried - 1, order_.data() + last);
    const std::int64_t added = add(frame, target, first, tried);
    if (sum + added <= most || tried == 1) {
      sum += added;
      first = tried;
    } else {
      remove(first, tried);
      last = tried - 1;
      is_limited = true;
    }
  }
  return {first, sum};
}

std::size_t TrackerEncoder::write_first(const TrackerFrame& frame, std::uint32_t count) {
  for (std::uint32_t i = 0; i < order_.size(); ++i) candidates_[order_[i].index].is_sent = i < count;
  return write(frame, false);
}

std::size_t TrackerEncoder::write(const TrackerFrame& frame, bool all) {
  frame.for_each_block([&](const Block& block) { write_block(frame, block, all); });
  std::size_t size_bytes = 0;
  bool fits = true;
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    fits = fits && parts_[b].fits;
    if (frame.delta.blocks[b].corrected == 0) continue;
    const bool is_last = b + 1 == parts_.size();
    size_bytes +=
        is_last ? 1 + parts_[b].coded_bytes : section_bytes(leb128_bytes(b) + parts_[b].coded_bytes);
  }
  return fits ? size_bytes : kTooLarge;
}

void TrackerEncoder::write_block(const TrackerFrame& frame, const Block& block, bool all) {
  TrackerDelta::Part& coded = frame.delta.blocks[block.index];
  Part& part = parts_[block.index];
  Slot* const corrected = frame.delta.slots.data() + block.first;
  TrackerCorrection* const corrections = frame.delta.corrections.data() + block.first;
  std::uint32_t count = 0;
  for (std::uint32_t i = block.first; i < block.first + part.candidates; ++i) {
    const Candidate& candidate = candidates_[i];
    if (candidate.state != Candidate::Steps::kFound || !(all || candidate.is_sent)) continue;
    corrected[count] = candidate.slot;
    corrections[count++] = candidate.correction;
  }
  coded.corrected = count;
  part.coded_bytes = 0;
  part.fits = true;
  if (count == 0) return;
  const std::size_t room =
      most_tracker_bytes_per_body(frame.memory.turns()) * block.slots + kTrackerSlackBytes;
  RangeEncoder coder{std::span<std::byte>(bytes_).subspan(part.first_byte, room)};
  const std::uint16_t* const p1 = frame.memory.models().p1.data();
  frame.list_flags(block);
  // A model becomes a decision: 2 * model + bit.
  const std::span<std::uint16_t> flags = std::span(frame.scratch.flags).subspan(block.first, block.slots);
  for (std::uint16_t& flag : flags) flag = static_cast<std::uint16_t>(2 * flag);
  for (std::uint32_t i = 0; i < count; ++i) {
    std::uint16_t& flag = frame.scratch.flags[corrected[i]];
    coded.count_one(flag / 2U);
    ++flag;
  }
  coder.put_all(flags, p1);
  DecisionList list;
  const auto code_list = [&] {
    for (const std::uint32_t decision : list.decisions()) ++coded.counts[decision / 2][decision % 2];
    coder.put_all(list.decisions(), p1);
    list.clear();
  };
  for (std::uint32_t i = 0; i < count; ++i) {
    if (list.is_full()) code_list();
    if (frame.memory.turns()) {
      frame.code(list, corrected[i], corrections[i]);
    } else {
      list.add(frame.scratch.contexts.of(corrected[i]), corrections[i]);
    }
  }
  code_list();
  part.coded_bytes = coder.finish();
  part.fits = !coder.overflow();
}

void TrackerEncoder::remember_waiting(const TrackerFrame& frame) {
  some_wait_ = false;
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    const Block block = block_at(b, static_cast<std::uint32_t>(waiting_.size()));
    const Slot* sent = frame.delta.slots.data() + block.first;
    const Slot* const sent_end = sent + frame.delta.blocks[b].corrected;
    const Candidate* candidate = candidates_.data() + block.first;
    const Candidate* const end = candidate + parts_[b].candidates;
    for (Slot slot = block.first; slot < block.first + block.slots; ++slot) {
      const bool is_candidate = candidate != end && candidate->slot == slot;
      const bool is_sent = sent != sent_end && *sent == slot;
      const bool waits =
          is_candidate && candidate->must && candidate->state != Candidate::Steps::kUseless && !is_sent;
      waiting_[slot] = waits ? static_cast<std::uint8_t>(std::min(waiting_[slot] + 1, 255)) : std::uint8_t{0};
      some_wait_ = some_wait_ || waits;
      candidate += is_candidate ? 1 : 0;
      sent += is_sent ? 1 : 0;
    }
  }
}

}  // namespace tandem
