#include "tests/fault/world/truth.hpp"

#include <utility>

#include "sdk/core/lattice/hash.hpp"

namespace tandem::world {

std::string Truth::begin(Epoch epoch, Epoch continues_epoch, Frame continues_frame) {
  if (const Lineage* known = this->lineage(epoch); known != nullptr && known->announced)
    return "epoch " + std::to_string(epoch) + " was there before";
  std::erase_if(hashes_, [epoch](const auto& entry) { return entry.first.epoch == epoch; });
  Lineage lineage{.continues_epoch = continues_epoch,
                  .continues_frame = continues_frame,
                  .last = continues_frame,
                  .announced = false,
                  .acted = {}};
  if (continues_epoch != 0) {
    const Lineage* before = this->lineage(continues_epoch);
    if (before == nullptr) return "continues epoch " + std::to_string(continues_epoch) + ", which never was";
    if (continues_frame > before->last)
      return "continues from frame " + std::to_string(continues_frame) + ", which was never made";
    for (const auto& [value, frame] : before->acted)
      if (frame <= continues_frame) lineage.acted.emplace(value, frame);
  }
  lineages_.insert_or_assign(epoch, std::move(lineage));
  return {};
}

std::string Truth::announce(Epoch epoch) {
  if (std::exchange(lineages_.at(epoch).announced, true))
    return "epoch " + std::to_string(epoch) + " is announced by a second server";
  return {};
}

std::string Truth::act(Epoch epoch, double value, Frame frame) {
  ++acts_;
  const auto [known, is_new] = lineages_.at(epoch).acted.emplace(value, frame);
  if (is_new) return {};
  return "input " + std::to_string(value) + " acted on frame " + std::to_string(known->second) +
         " and again on frame " + std::to_string(frame);
}

void Truth::made(Epoch epoch, Frame frame) { lineages_.at(epoch).last = frame; }

std::string Truth::hold(Epoch epoch, std::uint32_t stream, Frame frame, std::uint64_t hash) {
  const auto [known, is_new] = hashes_.emplace(State{epoch, stream, frame}, hash);
  if (is_new || known->second == hash) return {};
  return "frame " + std::to_string(frame) + " of stream " + std::to_string(stream) + ", epoch " +
         std::to_string(epoch) + " has hash " + to_hex(hash) + " here, and " + to_hex(known->second) +
         " elsewhere";
}

bool Truth::knows(Epoch epoch, std::uint32_t stream, Frame frame) const {
  return hashes_.contains(State{epoch, stream, frame});
}

const Lineage* Truth::lineage(Epoch epoch) const {
  const auto found = lineages_.find(epoch);
  return found == lineages_.end() ? nullptr : &found->second;
}

std::optional<Frame> Truth::acted(Epoch epoch, double value) const {
  const Lineage* of = lineage(epoch);
  if (of == nullptr) return std::nullopt;
  const auto found = of->acted.find(value);
  return found == of->acted.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace tandem::world
