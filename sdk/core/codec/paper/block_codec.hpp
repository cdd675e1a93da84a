#pragma once
// The common part of the thesis's codecs: scan a block, choose bodies, keep to the budget, write one section
// per block.

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/codec/paper/residual.hpp"
#include "sdk/core/codec/selection.hpp"
#include "sdk/core/lattice/assert.hpp"

namespace tandem {

/// A body that could be corrected in this frame.
struct Candidate {
  std::uint64_t error = 0;  ///< the value by which errors are compared: squared for positions, not squared
                            ///< for surfaces
  Slot slot = 0;
  std::uint16_t bits = 0;  ///< bits of the body's values
  Residual residual{};     ///< unused by codecs of absolute values
};

/// `Coding` says how the values of one body are measured, written, read and applied (absolute_coding.hpp,
/// residual_coding.hpp):
///   kEveryBody                                      whether bodies within the threshold are sent too
///   unsigned most_bits()                            a body can cost
///   bool measure(state, target, parameters, Candidate&)   fills bits and residual; false: nothing to send
///   begin()                                         forgets the delta before
///   void write(target, candidates, first, to)       values of one section, padded to bytes; remembers them
///   Result<void> parse(bytes, slots, first)         reads them; remembers them
///   void apply(state, slots, parameters)            does what is remembered
/// `first`: how many bodies of the delta come before those of the section.
template <class Coding>
class BlockCodec final : public Codec {
 public:
  BlockCodec(const CodecSetup& setup, Coding coding)
      : name_(setup.name),
        capacity_(setup.capacity),
        radii_(setup.radii.begin(), setup.radii.end()),
        coding_(std::move(coding)),
        corrected_(setup.capacity) {}

  [[nodiscard]] std::string_view name() const override { return name_; }
  [[nodiscard]] std::size_t bound() const override {
    std::size_t bytes = 0;
    for (std::uint32_t b = 0; b < block_count(capacity_); ++b) {
      const Block block = block_at(b, capacity_);
      // A list is used only if it is not longer than the mask.
      bytes += section_bytes(
          body_bytes(block, SelectionForm::kMask, 0, std::uint64_t{coding_.most_bits()} * block.slots));
    }
    return bytes;
  }

  Corrections encode(const CodecFrame& frame, const State& target, std::size_t budget, ByteWriter& out,
                     EncodeObserver* /*observer*/) override {
    scan(frame.predicted, target, frame.parameters);
    budget = std::min(budget, out.rest().size());
    if (total_bytes() > budget) keep_largest(budget);
    coding_.begin();
    std::size_t at = 0;
    for (std::uint32_t b = 0; b < plans_.size(); ++b) {
      const std::span<const Candidate> chosen = std::span(candidates_).subspan(at, plans_[b].chosen);
      if (!chosen.empty()) write_section(b, target, chosen, at, out);
      at += chosen.size();
    }
    TANDEM_ASSERT(at == candidates_.size());
    return {std::span(corrected_).first(at), frame.renewed, frame.parameters};
  }

  Result<Corrections> decode(const CodecFrame& frame, std::span<const Section> sections) override {
    TANDEM_ASSERT(frame.alive.size() == capacity_);
    coding_.begin();
    std::size_t count = 0;
    for (const Section& section : sections) {
      auto parsed = parse(section, frame.alive, count);
      if (!parsed) return tl::unexpected<Error>(parsed.error());
      count += *parsed;
    }
    return Corrections{std::span(corrected_).first(count), frame.renewed, frame.parameters};
  }

  void apply(const Corrections& corrections, State& state) override {
    TANDEM_ASSERT(corrections.slots.data() == corrected_.data());
    coding_.apply(state, corrections.slots, corrections.parameters);
  }

 private:
  struct Plan {
    std::uint32_t alive = 0;
    std::uint32_t chosen = 0;
    std::uint64_t bits = 0;
  };

  static std::size_t body_bytes(const Block& block, SelectionForm form, std::uint32_t chosen,
                                std::uint64_t bits) {
    return leb128_bytes(block.index) + 1 + selection_bytes(form, block.slots, chosen) +
           static_cast<std::size_t>((bits + 7) / 8);
  }
  [[nodiscard]] std::size_t plan_bytes(std::uint32_t index) const {
    const Plan& plan = plans_[index];
    if (plan.chosen == 0) return 0;
    const Block block = block_at(index, capacity_);
    const SelectionForm form = smallest_form(block.slots, plan.chosen, plan.alive);
    return section_bytes(body_bytes(block, form, plan.chosen, plan.bits));
  }
  [[nodiscard]] std::size_t total_bytes() const {
    std::size_t bytes = 0;
    for (std::uint32_t b = 0; b < plans_.size(); ++b) bytes += plan_bytes(b);
    return bytes;
  }

  // Reads the bodies of one section. Its first body is the `first`-th of the delta.
  Result<std::uint32_t> parse(const Section& section, std::span<const std::uint8_t> alive,
                              std::size_t first) {
    ByteReader in(section.body);
    const auto form = static_cast<SelectionForm>(in.get<std::uint8_t>());
    if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated corrections section");
    const auto chosen = parse_selection(form, block_at(section.block, capacity_), alive, in,
                                        std::span(corrected_).subspan(first));
    if (!chosen) return chosen;
    const std::span<const Slot> slots = std::span<const Slot>(corrected_).subspan(first, *chosen);
    auto values = coding_.parse(in.get_bytes(in.remaining()), slots, first);
    if (!values) return tl::unexpected<Error>(values.error());
    return chosen;
  }

  // Collects everything that is worth sending, ascending by slot, and the cost of each block.
  void scan(const State& state, const State& target, const CodecParameters& parameters) {
    candidates_.reserve(capacity_);
    candidates_.clear();
    plans_.assign(block_count(capacity_), Plan{});
    const std::uint8_t* alive = state.alive().data();
    for (std::uint32_t b = 0; b < plans_.size(); ++b) {
      const Block block = block_at(b, capacity_);
      Plan& plan = plans_[b];
      for (Slot slot = block.first; slot < block.first + block.slots; ++slot) plan.alive += alive[slot];
      const auto consider = [&](Slot slot, std::uint64_t error) {
        Candidate candidate{error, slot, 0, {}};
        if (!coding_.measure(state, target, parameters, candidate)) return;
        candidates_.push_back(candidate);
        ++plan.chosen;
        plan.bits += candidate.bits;
      };
      if constexpr (Coding::kEveryBody) {
        for (Slot slot = block.first; slot < block.first + block.slots; ++slot) {
          if (alive[slot] != 0) consider(slot, error_of(state, target, slot));
        }
      } else if (!radii_.empty()) {
        for_each_surface_beyond(state, target, block, parameters.threshold, radii_, consider);
      } else {
        marks_.resize(kBlockSlots);
        for_each_beyond(state, target, block, parameters.threshold,
                        std::span<std::uint8_t, kBlockSlots>(marks_.data(), kBlockSlots), consider);
      }
    }
  }

  [[nodiscard]] std::uint64_t error_of(const State& state, const State& target, Slot slot) const {
    return radii_.empty() ? error_squared(state, target, slot)
                          : surface_error(state.body(slot), target.body(slot), radii_[target.type()[slot]]);
  }

  // Keeps candidates in the order of their errors, and drops the first one that does not fit and all after
  // it.
  void keep_largest(std::size_t budget) {
    const auto first = [](const Candidate& a, const Candidate& b) {
      return a.error != b.error ? a.error > b.error : a.slot < b.slot;
    };
    // At most budget / cheapest body candidates fit, so only that many are sorted.
    std::uint16_t cheapest = UINT16_MAX;
    for (const Candidate& candidate : candidates_) cheapest = std::min(cheapest, candidate.bits);
    TANDEM_ASSERT(!candidates_.empty() && cheapest > 0);
    const std::size_t most = std::min(candidates_.size(), budget * 8 / cheapest + 1);
    std::nth_element(candidates_.begin(), candidates_.begin() + static_cast<std::ptrdiff_t>(most - 1),
                     candidates_.end(), first);
    std::sort(candidates_.begin(), candidates_.begin() + static_cast<std::ptrdiff_t>(most), first);

    for (Plan& plan : plans_) plan = {plan.alive, 0, 0};
    std::size_t bytes = 0;
    std::size_t kept = 0;
    for (; kept < most; ++kept) {
      const Candidate& candidate = candidates_[kept];
      const std::uint32_t block = candidate.slot / kBlockSlots;
      const Plan before = plans_[block];
      const std::size_t others = bytes - plan_bytes(block);
      plans_[block] = {before.alive, before.chosen + 1, before.bits + candidate.bits};
      if (others + plan_bytes(block) > budget) {
        plans_[block] = before;
        break;
      }
      bytes = others + plan_bytes(block);
    }
    TANDEM_ASSERT(bytes == total_bytes() && bytes <= budget);
    candidates_.resize(kept);
    std::sort(candidates_.begin(), candidates_.end(),
              [](const Candidate& a, const Candidate& b) { return a.slot < b.slot; });
  }

  // `chosen` are the corrected bodies from the `first`-th on.
  void write_section(std::uint32_t index, const State& target, std::span<const Candidate> chosen,
                     std::size_t first, ByteWriter& out) {
    const Block block = block_at(index, capacity_);
    const auto count = static_cast<std::uint32_t>(chosen.size());
    const std::span<Slot> slots = std::span(corrected_).subspan(first, count);
    for (std::uint32_t i = 0; i < count; ++i) slots[i] = chosen[i].slot;
    const SelectionForm form = smallest_form(block.slots, count, plans_[index].alive);
    const std::size_t begin = out.size();
    out.put(static_cast<std::uint8_t>(SectionType::kCorrections));
    out.put_leb128(body_bytes(block, form, count, plans_[index].bits));
    out.put_leb128(index);
    out.put(static_cast<std::uint8_t>(form));
    write_selection(form, block, slots, out);
    const auto size_bytes = static_cast<std::size_t>((plans_[index].bits + 7) / 8);
    coding_.write(target, chosen, first, out.rest().first(size_bytes));
    out.advance(size_bytes);
    TANDEM_ASSERT(out.size() - begin == plan_bytes(index));
  }

  std::string name_;
  std::uint32_t capacity_;
  std::vector<std::int32_t> radii_;  // with orientations
  Coding coding_;
  std::vector<Slot> corrected_;
  // Encoder only; allocated by the first encode().
  std::vector<Candidate> candidates_;
  std::vector<Plan> plans_;
  std::vector<std::uint8_t> marks_;
};

}  // namespace tandem
