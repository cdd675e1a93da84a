#pragma once
// The codec `tracker`: both sides treat each body as a tracking filter that small position corrections steer;
// no velocity is sent (tracker_filter.hpp). Which bodies, and how far, is range coded in adaptive contexts
// (tracker_models.hpp). Bytes: idl/PROTOCOL.md, "Tracker".

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/selection.hpp"
#include "sdk/core/codec/tracker_models.hpp"

namespace tandem {

class TrackerSearch;

/// See Codec. Coder state of a block lives across frames. Corrects every body that is off by more than the
/// threshold, and a few that soon would be. Where a budget binds, bodies go by error^2 * (frames they have
/// waited + 1)^2, so that none waits for ever; ties by slot.
class Tracker final : public Codec {
 public:
  /// `capacity` in 1 .. kMaxCapacity.
  explicit Tracker(std::uint32_t capacity);
  ~Tracker() override;
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;

  [[nodiscard]] std::string_view name() const override { return "tracker"; }
  [[nodiscard]] std::size_t bound() const override;
  void predicted_by(std::string_view predictor) override { gains_ = &tracker_gains(predictor); }
  void renew(const State& predicted, std::span<const Slot> slots) override;
  std::uint32_t encode(State& state, const State& target, const CodecParameters& parameters,
                       std::size_t budget, ByteWriter& out) override;
  void begin() override;
  Result<void> parse(std::span<const std::byte> section, std::span<const std::uint8_t> alive,
                     const CodecParameters& parameters) override;
  void apply(State& state) override;
  [[nodiscard]] std::span<const Slot> corrected() const override {
    return std::span(corrected_).first(count_);
  }
  [[nodiscard]] std::span<const std::byte> body_state() const override { return bodies_; }
  void save(ByteWriter& out) const override;
  [[nodiscard]] std::size_t save_bound() const override;
  [[nodiscard]] Result<void> load(std::span<const std::byte> bytes) override;

 private:
  friend class TrackerSearch;

  static constexpr std::size_t kColumns = 5;  // age, interval, steps x, y, z
  [[nodiscard]] std::span<std::byte> column(std::size_t i) {
    return std::span(bodies_).subspan(i * capacity_, capacity_);
  }
  [[nodiscard]] std::uint8_t remembered(std::size_t i, Slot slot) const {
    return std::to_integer<std::uint8_t>(bodies_[i * capacity_ + slot]);
  }
  [[nodiscard]] TrackerBody body(Slot slot) const;
  void set_body(Slot slot, const TrackerBody& body);
  [[nodiscard]] TrackerContext context(Slot slot, bool renewed, std::int32_t threshold) const;

  /// Calls f(slot, renewed, flag context without the previous flag) for the alive slots of a block.
  template <class F>
  void for_each_body(const Block& block, std::span<const std::uint8_t> alive, F&& f) const;
  Result<void> parse_block(const Block& block, std::span<const std::uint8_t> alive,
                           std::span<const std::byte> bytes);
  /// Forgets the renewed bodies, corrects the collected ones, takes over coder states, ages the others.
  void finish_frame(State& state, const TrackerSteppings& steppings);

  std::uint32_t capacity_;
  std::vector<std::byte> bodies_;      // columns of capacity bytes each
  std::vector<TrackerModels> models_;  // of each block
  std::vector<TrackerModels> work_;    // what models_ becomes if the delta is good
  std::vector<std::uint8_t> worked_;   // 1: take over work_ of this block
  // Of the frame at hand.
  const State* predicted_ = nullptr;
  std::vector<Slot> renewed_;
  std::vector<Slot> corrected_;
  std::vector<TrackerSteps> steps_;  // of corrected_
  std::size_t count_ = 0;
  std::uint32_t next_block_ = 0;
  std::int32_t threshold_ = 1;
  const TrackerGains* gains_ = &tracker_gains("ballistic");
  std::unique_ptr<TrackerSearch> search_;  // encoder only, made by the first encode()
};

inline TrackerBody Tracker::body(Slot slot) const {
  const std::byte* at = bodies_.data() + slot;
  TrackerBody body;
  body.age = std::to_integer<std::uint8_t>(*at);
  body.interval = std::to_integer<std::uint8_t>(*(at += capacity_));
  for (std::int8_t& step : body.steps) step = static_cast<std::int8_t>(*(at += capacity_));
  return body;
}

inline TrackerContext Tracker::context(Slot slot, bool renewed, std::int32_t threshold) const {
  if (renewed) return value_context({}, {}, {}, threshold);
  const State& state = *predicted_;
  return value_context(body(slot), {state.v(0)[slot], state.v(1)[slot], state.v(2)[slot]},
                       {state.c(0)[slot], state.c(1)[slot], state.c(2)[slot]}, threshold);
}

template <class F>
void Tracker::for_each_body(const Block& block, std::span<const std::uint8_t> alive, F&& f) const {
  const auto first = std::lower_bound(renewed_.begin(), renewed_.end(), block.first);
  const Slot* renewed = renewed_.data() + (first - renewed_.begin());
  const Slot* const renewed_end = renewed_.data() + renewed_.size();
  // Locals, because f writes bytes, which could be any member for all a compiler knows.
  const std::byte* const age = bodies_.data();
  const std::byte* const interval = age + capacity_;
  const std::uint8_t* const living = alive.data();
  const Slot end = block.first + block.slots;
  for (Slot slot = block.first; slot < end; ++slot) {
    const bool is_renewed = renewed != renewed_end && *renewed == slot;
    if (is_renewed) ++renewed;
    if (living[slot] == 0) continue;
    f(slot, is_renewed,
      is_renewed ? flag_context(0, 0)
                 : flag_context(std::to_integer<std::uint8_t>(age[slot]),
                                std::to_integer<std::uint8_t>(interval[slot])));
  }
}

}  // namespace tandem
