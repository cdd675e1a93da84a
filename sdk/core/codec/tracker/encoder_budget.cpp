#include <algorithm>

#include "sdk/core/codec/errors.hpp"
#include "sdk/core/codec/tracker/encoder.hpp"
#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

constexpr std::size_t kHeaderBytes = 1 + 2 + 1;  // estimated: type, length, block
// This share of a budget (1/64) may stay unused, and the sections are written at most this many times. If
// estimates mislead, the last times write half as many bodies.
constexpr std::size_t kSpareShare = 64;
constexpr std::uint32_t kMaxWrites = 8, kMaxEstimates = 4;
// In 1/256 bits: a byte, and a first guess of the cost of a body with its share of the flags.
constexpr std::int64_t kByte = std::int64_t{8} << 8U;
constexpr std::int64_t kGuessedCost = std::int64_t{16} << 8U;

}  // namespace

std::uint64_t TrackerEncoder::error_of(const TrackerFrame& frame, const State& target, Slot slot) {
  const State& predicted = frame.at.predicted;
  if (!frame.memory.turns()) return error_squared(predicted, target, slot);
  const std::uint64_t error =
      surface_error(predicted.body(slot), target.body(slot), frame.memory.radii()[target.type()[slot]]);
  return error * error;
}

void TrackerEncoder::choose(const TrackerFrame& frame, const State& target, const Worth& worth,
                            Candidate& candidate) const {
  candidate.is_open = false;
  const bool inside = choose(frame, target, worth, candidate.slot, candidate.correction);
  const bool is_some_way = is_some(candidate.correction.steps) || is_some(candidate.correction.turn);
  candidate.is_of_use = inside || (is_some_way && candidate.error > worth.moving.limit);
}

void TrackerEncoder::collect(const TrackerFrame& frame, const State& target, const Block& block,
                             bool chosen) {
  const std::uint32_t count = frame.delta.blocks[block.index].corrected;
  for (std::uint32_t i = block.first; i < block.first + count; ++i) {
    const Slot slot = frame.delta.slots[i];
    Candidate& candidate = candidates_[i];
    candidate = {error_of(frame, target, slot), slot, kNoCost, !chosen, chosen, false, {}};
    if (!chosen) continue;
    if (frame.memory.turns()) {
      candidate.correction = frame.delta.turning(i);
    } else {
      candidate.correction = {frame.delta.corrections[i], {}};
    }
  }
  parts_[block.index].candidates = count;
}

void TrackerEncoder::list(const TrackerFrame& frame, const Block& block, bool all) const {
  std::uint32_t count = 0;
  for (std::uint32_t i = block.first; i < block.first + parts_[block.index].candidates; ++i) {
    const Candidate& candidate = candidates_[i];
    if (!candidate.is_of_use || !(all || candidate.is_sent)) continue;
    frame.delta.slots[block.first + count] = candidate.slot;
    if (frame.memory.turns()) {
      frame.delta.set(block.first + count, candidate.correction);
    } else {
      frame.delta.corrections[block.first + count] =
          static_cast<const TrackerCorrection&>(candidate.correction);
    }
    ++count;
  }
  frame.delta.blocks[block.index].corrected = count;
}

bool TrackerEncoder::write_most_urgent(const TrackerFrame& frame, const State& target, std::size_t budget,
                                       bool chosen) {
  candidates_.resize(waiting_.size());
  order_.reserve(waiting_.size());
  frame.for_each_block([&](const Block& block) { collect(frame, target, block, chosen); });
  rank(frame);
  const auto all = static_cast<std::uint32_t>(order_.size());
  bool may_all_fit = some_wait_;  // false: they were tried
  const auto try_all = [&] {
    may_all_fit = false;
    const Worth worth(frame.at.parameters.threshold);
    frame.for_each_block([&](const Block& block) {
      Candidate* const first = candidates_.data() + block.first;
      for (Candidate* candidate = first; candidate != first + parts_[block.index].candidates; ++candidate) {
        if (candidate->is_open) choose(frame, target, worth, *candidate);
      }
      list(frame, block, true);
    });
    return write(frame) <= budget;
  };
  if (all == 0 && may_all_fit && try_all()) return true;
  std::uint32_t fits = 0;
  std::uint32_t too_many = all + 1;
  std::uint32_t written = too_many;
  std::int64_t beyond = kByte;  // excess of the written size over the estimate
  for (std::uint32_t i = 0; i < kMaxWrites && too_many - fits > 1; ++i) {
    std::uint32_t last = too_many - 1;
    if (i >= kMaxEstimates) {
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
    TrackerFlags flags;  // NOLINT(cppcoreguidelines-pro-type-member-init): only counted
    frame.list_flags(block, flags);
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
  const std::uint64_t limit = Worth(frame.at.parameters.threshold).moving.limit;
  constexpr std::uint64_t kMaxError = (std::uint64_t{1} << 48U) - 1;  // so that the product fits
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    const std::uint32_t first = b * kBlockSlots;
    for (std::uint32_t i = first; i < first + parts_[b].candidates; ++i) {
      const Candidate& candidate = candidates_[i];
      const std::uint64_t frames = waiting_[candidate.slot] + 1U;
      if (candidate.error > limit)
        order_.push_back({std::min(candidate.error, kMaxError) * frames * frames, i});
    }
  }
}

std::int32_t TrackerEncoder::cost(const TrackerFrame& frame, const Candidate& candidate) const {
  const auto& flag = costs_.of[frame.flag_of(candidate.slot)];
  CostCoder coder{&costs_};
  TrackerTurningCorrection correction = candidate.correction;
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
    if (candidate.is_open) choose(frame, target, worth, candidate);
    if (!candidate.is_of_use) continue;
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
    if (!candidate.is_of_use) continue;
    Part& part = parts_[index / kBlockSlots];
    sum += candidate.cost + (--part.sent == 0 ? part.cost : 0);
  }
  return sum;
}

TrackerEncoder::Cut TrackerEncoder::cut(const TrackerFrame& frame, const State& target, std::uint32_t first,
                                        std::uint32_t last, std::int64_t most) {
  TANDEM_ASSERT(first <= last && last <= order_.size());
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
  TANDEM_ASSERT(count <= order_.size());
  for (std::uint32_t i = 0; i < order_.size(); ++i) candidates_[order_[i].index].is_sent = i < count;
  frame.for_each_block([&](const Block& block) { list(frame, block, false); });
  return write(frame);
}

void TrackerEncoder::remember_waiting(const TrackerFrame& frame) {
  some_wait_ = false;
  const std::uint64_t limit = Worth(frame.at.parameters.threshold).moving.limit;
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    const Block block = block_at(b, static_cast<std::uint32_t>(waiting_.size()));
    const Slot* sent = frame.delta.slots.data() + block.first;
    const Slot* const sent_end = sent + frame.delta.blocks[b].corrected;
    const Candidate* candidate = candidates_.data() + block.first;
    const Candidate* const end = candidate + parts_[b].candidates;
    for (Slot slot = block.first; slot < block.first + block.slots; ++slot) {
      const bool is_candidate = candidate != end && candidate->slot == slot;
      const bool is_sent = sent != sent_end && *sent == slot;
      const bool waits = is_candidate && candidate->error > limit &&
                         (candidate->is_open || candidate->is_of_use) && !is_sent;
      waiting_[slot] = waits ? static_cast<std::uint8_t>(std::min(waiting_[slot] + 1, 255)) : std::uint8_t{0};
      some_wait_ = some_wait_ || waits;
      candidate += is_candidate ? 1 : 0;
      sent += is_sent ? 1 : 0;
    }
    TANDEM_ASSERT(candidate == end && sent == sent_end);  // both ascend, and are of this block
  }
}

}  // namespace tandem
