#pragma once
// The codec `tracker`. Both sides treat each body as a tracking filter that small position corrections steer;
// no velocity is sent (filter.hpp). The choice of bodies and the corrections are range coded, with
// probabilities that learn from delta to delta (models.hpp). Bytes: idl/PROTOCOL.md, "Tracker".

#include <memory>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/tracker/decoder.hpp"
#include "sdk/core/codec/tracker/encoder.hpp"
#include "sdk/core/codec/tracker/memory.hpp"

namespace tandem {

/// See Codec. Blocks are coded in parallel if the setup says how. Corrects every body whose error is above
/// the threshold, and a few whose error soon would be. If a budget does not suffice, bodies are ordered by
/// error^2 * (frames they have waited + 1)^2, so that none waits for ever; ties by slot.
class Tracker final : public Codec {
 public:
  explicit Tracker(const CodecSetup& setup);

  [[nodiscard]] std::string_view name() const override { return "tracker"; }
  [[nodiscard]] std::size_t bound() const override {
    return tracker_bound(memory_.capacity(), memory_.turns());
  }
  Corrections encode(const CodecFrame& at, const State& target, std::size_t budget, ByteWriter& out,
                     EncodeObserver* observer) override;
  Result<Corrections> decode(const CodecFrame& at, std::span<const Section> sections) override;
  void apply(const Corrections& corrections, State& state) override;
  [[nodiscard]] std::span<const std::byte> columns() const override { return memory_.columns(); }
  [[nodiscard]] BlockNumbers column_numbers() const override { return memory_.numbers(); }
  [[nodiscard]] Guess guess(std::size_t column) const override { return TrackerMemory::guess(column); }
  void save_models(NumberEncoder& out) const override { memory_.save_models(out); }
  [[nodiscard]] std::size_t models_bits_bound() const override { return memory_.models_bits_bound(); }
  [[nodiscard]] Result<void> load(std::span<const std::byte> columns, NumberDecoder& models) override {
    return memory_.load(columns, models);
  }

 private:
  [[nodiscard]] TrackerFrame frame(const CodecFrame& at) {
    return {memory_, at, scratch_, delta_, run_blocks_};
  }

  RunBlocks run_blocks_;
  TrackerMemory memory_;
  TrackerScratch scratch_;
  TrackerDelta delta_;  // the delta of the last encode() or decode()
  TrackerDecoder decoder_;
  std::unique_ptr<TrackerEncoder> encoder_;  // made by the first encode(): a decoder needs none of its memory
};

}  // namespace tandem
