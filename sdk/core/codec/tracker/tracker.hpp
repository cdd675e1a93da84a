#pragma once
// The codec `tracker`: both sides treat each body as a tracking filter that small position corrections steer;
// no velocity is sent (tracker_filter.hpp). Which bodies, and how far, is range coded with probabilities that
// learn from delta to delta (tracker_models.hpp). Bytes: idl/PROTOCOL.md, "Tracker".

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/selection.hpp"
#include "sdk/core/codec/tracker/models.hpp"

namespace tandem {

class TrackerSearch;

/// See Codec. Blocks are coded side by side where the setup says how. Corrects every body that is off
/// by more than the threshold, and a few that soon would be. Where a budget binds, bodies go by error^2 *
/// (frames they have waited + 1)^2, so that none waits for ever; ties by slot.
class Tracker final : public Codec {
 public:
  explicit Tracker(const CodecSetup& setup);
  ~Tracker() override;
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;

  [[nodiscard]] std::string_view name() const override { return "tracker"; }
  [[nodiscard]] std::size_t bound() const override;
  void account_to(CodeAccount* account) override { account_ = account; }
  void evidence_to(GainEvidence* evidence) override { evidence_ = evidence; }
  void renew(const State& predicted, std::span<const Slot> slots) override;
  std::uint32_t encode(State& state, const State& target, const CodecParameters& parameters,
                       std::size_t budget, ByteWriter& out) override;
  void begin() override;
  Result<void> parse(std::span<const std::byte> section, std::span<const std::uint8_t> alive,
                     const CodecParameters& parameters) override;
  Result<void> parse_end() override;
  void apply(State& state) override;
  [[nodiscard]] std::span<const Slot> corrected() const override {
    return std::span(corrected_).first(count_);
  }
  [[nodiscard]] std::span<const std::byte> body_state() const override { return bodies_; }
  void save(ByteWriter& out) const override;
  [[nodiscard]] std::size_t save_bound() const override;
  [[nodiscard]] Result<void> load(std::span<const std::byte> bytes,
                                  std::span<const std::uint8_t> alive) override;

 private:
  friend class TrackerSearch;

  /// A block in the frame at hand. Its corrected slots and their steps stand from `block.first` on in
  /// corrected_ and steps_.
  struct Work {
    std::span<const std::byte> stream;  // decoder: the section's code stream
    std::uint32_t corrected = 0;
    const char* broken = nullptr;  // decoder: why the stream is none
    TrackerCounts counts{};
    GainEvidence evidence;
    /// A decision that list_flags() counted as a zero is a one.
    void count_one(std::uint32_t model) {
      --counts[model][0];
      ++counts[model][1];
    }
  };

  static constexpr std::size_t kColumns = 5;  // age, interval, steps x, y, z
  [[nodiscard]] std::span<std::byte> column(std::size_t i) {
    return std::span(bodies_).subspan(i * capacity_, capacity_);
  }
  [[nodiscard]] TrackerBody body(Slot slot) const;
  void set_body(Slot slot, const TrackerBody& body);
  [[nodiscard]] bool is_renewed(Slot slot) const {
    return !renewed_.empty() && std::binary_search(renewed_.begin(), renewed_.end(), slot);
  }
  [[nodiscard]] std::uint32_t flag_of(Slot slot) const {
    return is_renewed(slot) ? flag_model(0, 0)
                            : flag_model(std::to_integer<std::uint8_t>(bodies_[slot]), history_[slot]);
  }

  void use(const CodecParameters& parameters) {
    threshold_ = parameters.threshold;
    gains_.set(parameters.velocity_gain, parameters.acceleration_gain);
  }
  /// Calls job(block) for all blocks, perhaps on several threads.
  template <class Job>
  void for_each_block(const Job& job) const;
  /// Fills flags_ of a block, and counts its flags as zeros. Dead slots have a model that is never a one and
  /// takes no bits, so that loops need not ask.
  void list_flags(const Block& block, std::span<const std::uint8_t> alive, Work& work);
  /// Fills contexts_ of a block, at least those of `slots`.
  void list_contexts(const Block& block, std::span<const Slot> slots);
  /// Null, or why the stream is none.
  const char* decode_block(const Block& block, Work& work);
  /// Forgets the renewed bodies, corrects the collected ones, learns, ages the others.
  void finish_frame(State& state, const TrackerSteppings& steppings);
  void finish_block(State& state, const Block& block, const TrackerSteppings& steppings);

  std::uint32_t capacity_;
  std::vector<std::byte> bodies_;      // columns of capacity bytes each
  std::vector<std::uint8_t> history_;  // flag_history() of each body
  TrackerModels models_;
  RunBlocks run_;
  CodeAccount* account_ = nullptr;
  GainEvidence* evidence_ = nullptr;
  // Of the frame at hand.
  const State* predicted_ = nullptr;
  std::span<const std::uint8_t> alive_;
  std::vector<std::uint16_t> flags_;  // model of each slot's flag
  TrackerContexts contexts_;
  std::vector<Slot> renewed_;
  std::vector<Slot> corrected_;
  std::vector<TrackerSteps> steps_;
  std::vector<Work> work_;  // by block
  std::size_t count_ = 0;   // corrected_, once it is whole
  std::uint32_t next_block_ = 0;
  std::int32_t threshold_ = 1;
  TrackerGains gains_;
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

template <class Job>
void Tracker::for_each_block(const Job& job) const {
  const auto blocks = static_cast<std::uint32_t>(work_.size());
  const auto run = [&](std::uint32_t b) { job(block_at(b, capacity_)); };
  if (run_ && blocks > 1) {
    run_(blocks, run);
  } else {
    for (std::uint32_t b = 0; b < blocks; ++b) run(b);
  }
}

}  // namespace tandem
