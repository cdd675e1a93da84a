#include "sdk/core/codec/tracker/encoder.hpp"

#include <algorithm>

#include "sdk/core/codec/errors.hpp"
#include "sdk/core/codec/tracker/step_batch.hpp"
#include "sdk/core/lattice/assert.hpp"

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
// Memory for the code stream of a block at first. Bodies that all move at random take two bytes.
constexpr std::size_t kUsualBytesPerBody = 4;

Vec3i position(const State& state, Slot slot) {
  return {state.p(0)[slot], state.p(1)[slot], state.p(2)[slot]};
}

}  // namespace

TrackerEncoder::Worth::Worth(std::int32_t threshold)
    : moving(threshold, kErrorWorth), at_rest(threshold, kRestingErrorWorth) {}

TrackerEncoder::TrackerEncoder(const TrackerMemory& memory)
    : streams_(block_count(memory.capacity())),
      parts_(streams_.size()),
      waiting_(memory.capacity()),
      stillness_(memory.capacity(), memory.radii()),
      suspects_(memory.capacity()) {
  for (std::uint32_t b = 0; b < streams_.size(); ++b) {
    const std::uint32_t slots = block_at(b, memory.capacity()).slots;
    const auto bytes = [&](std::size_t of_body) { return of_body * slots + kTrackerSlackBytes; };
    streams_[b].most_bytes = bytes(most_tracker_bytes_per_body(memory.turns()));
    streams_[b].bytes.resize(bytes(memory.turns() ? 2 * kUsualBytesPerBody : kUsualBytesPerBody));
  }
}

std::span<const Slot> TrackerEncoder::encode(const TrackerFrame& frame, const State& target,
                                             std::size_t budget, ByteWriter& out) {
  const std::size_t bound = tracker_bound(frame.memory.capacity(), frame.memory.turns());
  budget = std::min({budget, bound, out.rest().size()});
  const std::size_t before = out.size();
  costs_.learn(frame.memory.models());
  stillness_.begin(frame.at);
  // If bodies wait, the budget was too small in the previous frame and probably still is.
  const bool is_enough = !some_wait_ || budget >= bound;
  if (!is_enough) frame.for_each_block([&](const Block& block) { gather(frame, target, block); });
  const bool all_fit = (is_enough && choose_and_write(frame, target) <= budget) ||
                       write_most_urgent(frame, target, budget, is_enough);
  for (std::uint32_t b = 0; b < streams_.size(); ++b) {
    if (frame.delta.blocks[b].corrected == 0) continue;
    const std::span<const std::byte> stream = streams_[b].written();
    if (b + 1 == streams_.size()) {
      out.put(static_cast<std::uint8_t>(SectionType::kLastCorrections));
    } else {
      out.put(static_cast<std::uint8_t>(SectionType::kCorrections));
      out.put_leb128(leb128_bytes(b) + stream.size());
      out.put_leb128(b);
    }
    out.put_bytes(stream);
  }
  TANDEM_ASSERT(out.size() - before <= budget && out.size() - before == size_bytes(frame));
  if (!all_fit) {
    remember_waiting(frame);
  } else if (some_wait_) {
    some_wait_ = false;
    std::fill(waiting_.begin(), waiting_.end(), std::uint8_t{0});
  }
  frame.for_each_block([&](const Block& block) { stillness_.remember(frame.at, target, block); });
  return frame.join();
}

template <class Found>
void TrackerEncoder::scan(const TrackerFrame& frame, const State& target, const Block& block,
                          std::int32_t early, const Found& found) {
  const State& predicted = frame.at.predicted;
  if (!frame.memory.turns()) {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before it is read
    std::array<std::uint8_t, kBlockSlots> marks;
    for_each_beyond(predicted, target, block, early, marks, found);
    return;
  }
  for_each_surface_beyond(predicted, target, block, early, frame.memory.radii(),
                          [&](Slot slot, std::uint64_t error) { found(slot, error * error); });
}

void TrackerEncoder::gather(const TrackerFrame& frame, const State& target, const Block& block) {
  const std::uint64_t limit = Worth(frame.at.parameters.threshold).moving.limit;
  const auto early = static_cast<std::int32_t>((frame.at.parameters.threshold * kEarlyShare) >> 8);
  Slot* const slots = frame.delta.slots.data() + block.first;
  std::uint32_t count = 0;
  const auto consider = [&](Slot slot, std::uint64_t error) {
    if (error <= limit && frame.memory.models().p1[frame.flag_of(slot)] <= frame.memory.gains().early())
      return;
    slots[count++] = slot;
  };
  suspects_.find(
      frame.at, block, early, [&](const auto& found) { scan(frame, target, block, early, found); }, consider);
  frame.list_contexts(block, std::span(slots, count));
  frame.delta.blocks[block.index].corrected = count;
}

bool TrackerEncoder::choose(const TrackerFrame& frame, const State& target, const Worth& worth, Slot slot,
                            TrackerTurningCorrection& correction) const {
  correction.rest = stillness_.is_still(frame.at, target, slot);
  const ErrorWorth& of_error = correction.rest ? worth.at_rest : worth.moving;
  const TrackerContext context = frame.scratch.contexts.of(slot);
  const std::int32_t threshold = frame.at.parameters.threshold;
  if (frame.memory.turns()) {
    const BodyState from = frame.at.predicted.body(slot);
    const BodyState to = target.body(slot);
    const std::int32_t radius = frame.memory.radii()[target.type()[slot]];
    return choose_joint_steps({from, to, radius, threshold, frame.at.rounding}, of_error, costs_, context,
                              frame.turn_context_of(slot), correction);
  }
  return choose_steps(position(frame.at.predicted, slot), position(target, slot),
                      TrackerSteppings(threshold, frame.at.rounding.p), of_error, costs_, context,
                      correction.steps);
}

// A body beyond the threshold is corrected even if no point is within it. One that is within it is corrected
// early only if that keeps it there.
void TrackerEncoder::choose(const TrackerFrame& frame, const State& target, const Block& block) {
  const Worth worth(frame.at.parameters.threshold);
  std::uint32_t& corrected = frame.delta.blocks[block.index].corrected;
  const std::uint32_t end = block.first + corrected;
  std::uint32_t kept = block.first;
  if (frame.memory.turns()) {
    for (std::uint32_t i = block.first; i < end; ++i) {
      const Slot slot = frame.delta.slots[i];
      TrackerTurningCorrection correction;
      const bool inside = choose(frame, target, worth, slot, correction);
      const bool is_some_way = is_some(correction.steps) || is_some(correction.turn);
      if (!inside && !(is_some_way && is_beyond(frame, target, worth, slot))) continue;
      frame.delta.slots[kept] = slot;
      frame.delta.set(kept++, correction);
    }
    corrected = kept - block.first;
    return;
  }
  const TrackerSteppings steppings(frame.at.parameters.threshold, frame.at.rounding.p);
  StepBatch batch(steppings, worth.moving, worth.at_rest, costs_);
  std::array<bool, StepBatch::kMaxBodies> rests{};
  for (std::uint32_t first = block.first; first < end; first += StepBatch::kMaxBodies) {
    const std::uint32_t count = std::min(StepBatch::kMaxBodies, end - first);
    const Slot* const slots = frame.delta.slots.data() + first;
    for (std::uint32_t i = 0; i < count; ++i) {
      rests[i] = stillness_.is_still(frame.at, target, slots[i]);
      batch.add(position(frame.at.predicted, slots[i]), position(target, slots[i]), rests[i]);
    }
    batch.run([&](std::uint32_t i) { return frame.scratch.contexts.of(slots[i]); });
    for (std::uint32_t i = 0; i < count; ++i) {
      const TrackerSteps steps = batch.steps(i);
      if (!batch.inside(i) && !(is_some(steps) && is_beyond(frame, target, worth, slots[i]))) continue;
      frame.delta.slots[kept] = slots[i];
      frame.delta.corrections[kept++] = {steps, false, rests[i]};
    }
  }
  corrected = kept - block.first;
}

template <class Job>
void TrackerEncoder::for_each_pair(const TrackerFrame& frame, const Job& job) const {
  const auto blocks = static_cast<std::uint32_t>(streams_.size());
  const std::uint32_t together = frame.lanes_for(blocks);
  run_jobs((blocks + together - 1) / together, frame.run_blocks, [&](std::uint32_t i) {
    std::array<Block, kLanes> some{};
    const std::uint32_t count = std::min(together, blocks - i * together);
    for (std::uint32_t k = 0; k < count; ++k) some[k] = block_at(i * together + k, frame.memory.capacity());
    job(std::span<const Block>(some).first(count));
  });
}

std::size_t TrackerEncoder::choose_and_write(const TrackerFrame& frame, const State& target) {
  for_each_pair(frame, [&](std::span<const Block> blocks) {
    for (const Block& block : blocks) {
      gather(frame, target, block);
      choose(frame, target, block);
    }
    write_streams(frame, blocks, &streams_[blocks.front().index]);
  });
  return size_bytes(frame);
}

std::size_t TrackerEncoder::write(const TrackerFrame& frame) {
  for_each_pair(frame, [&](std::span<const Block> blocks) {
    write_streams(frame, blocks, &streams_[blocks.front().index]);
  });
  return size_bytes(frame);
}

std::size_t TrackerEncoder::size_bytes(const TrackerFrame& frame) const {
  std::size_t sum = 0;
  bool fits = true;
  for (std::uint32_t b = 0; b < streams_.size(); ++b) {
    fits = fits && streams_[b].fits;
    if (frame.delta.blocks[b].corrected == 0) continue;
    const std::size_t stream = streams_[b].size_bytes;
    sum += b + 1 == streams_.size() ? 1 + stream : section_bytes(leb128_bytes(b) + stream);
  }
  return fits ? sum : kTooLarge;
}

}  // namespace tandem
