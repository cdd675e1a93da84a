#include "sdk/core/codec/tracker/tracker.hpp"

#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

void report(const TrackerFrame& frame, std::span<const Slot> corrected, EncodeObserver& observer) {
  const TrackerDelta& delta = frame.delta;
  if (!corrected.empty()) {
    observer.decided(std::span(frame.memory.models().p1).first(TrackerModelIndex::kDead),
                     std::span(*delta.seen).first(TrackerModelIndex::kDead));
  }
  GainEvidence evidence;
  const State& predicted = frame.at.predicted;
  for (std::size_t block = 0; block < delta.blocks.size(); ++block) {
    const TrackerDelta::Part& part = delta.blocks[block];
    for (std::uint32_t i = 0; i < part.corrected; ++i) {
      const Slot slot = corrected[part.first + i];
      const TrackerSteps& steps = delta.corrections[block * kBlockSlots + i].steps;
      if (frame.is_renewed(slot) || !is_some(steps)) continue;
      add_evidence(frame.memory.body(slot), steps,
                   {predicted.c(0)[slot], predicted.c(1)[slot], predicted.c(2)[slot]}, evidence);
    }
  }
  observer.steered(evidence);
}

}  // namespace

Tracker::Tracker(const CodecSetup& setup)
    : run_blocks_(setup.run_blocks),
      memory_(setup),
      scratch_(setup.capacity),
      delta_(setup.capacity, memory_.turns()),
      decoder_(setup.capacity) {}

Corrections Tracker::encode(const CodecFrame& at, const State& target, std::size_t budget, ByteWriter& out,
                            EncodeObserver* observer) {
  TANDEM_ASSERT(at.alive.size() == memory_.capacity() && target.capacity() == memory_.capacity());
  if (!encoder_) encoder_ = std::make_unique<TrackerEncoder>(memory_);
  const TrackerFrame frame = this->frame(at);
  const std::span<const Slot> corrected = encoder_->encode(frame, target, budget, out);
  if (observer != nullptr) report(frame, corrected, *observer);
  return {corrected, at.renewed, at.parameters, at.gravity, at.rounding};
}

Result<Corrections> Tracker::decode(const CodecFrame& at, std::span<const Section> sections) {
  TANDEM_ASSERT(at.alive.size() == memory_.capacity());
  const auto corrected = decoder_.decode(frame(at), sections);
  if (!corrected) return tl::unexpected<Error>(corrected.error());
  return Corrections{*corrected, at.renewed, at.parameters, at.gravity, at.rounding};
}

void Tracker::apply(const Corrections& corrections, State& state) {
  TANDEM_ASSERT(corrections.slots.data() == delta_.slots.data());
  memory_.apply(delta_, corrections, run_blocks_, state);
}

}  // namespace tandem
