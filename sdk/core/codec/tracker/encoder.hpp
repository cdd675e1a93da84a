#pragma once
// The tracker's encoder: chooses the bodies to correct. steps.hpp chooses by how much. Nothing here is on the
// wire.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/codec/stillness.hpp"
#include "sdk/core/codec/suspects.hpp"
#include "sdk/core/codec/tracker/block_writer.hpp"
#include "sdk/core/codec/tracker/frame.hpp"
#include "sdk/core/codec/tracker/steps.hpp"

namespace tandem {

/// The encoder keeps to this limit as to a budget. Bodies that all jump at once take about a third of it.
[[nodiscard]] constexpr std::size_t most_tracker_bytes_per_body(bool turns) { return turns ? 48 : 24; }
inline constexpr std::size_t kTrackerSlackBytes = 64;
/// Maximum number of bytes of sections for a capacity.
[[nodiscard]] constexpr std::size_t tracker_bound(std::uint32_t capacity, bool turns) {
  return block_count(capacity) * (kMaxSectionHeaderBytes + kMaxBlockNumberBytes + kTrackerSlackBytes) +
         most_tracker_bytes_per_body(turns) * capacity;
}

/// Chooses the bodies to correct. Besides scratch memory it keeps how long each body has waited for its
/// correction, and where the body was.
class TrackerEncoder {
 public:
  /// `memory` must outlive the encoder.
  explicit TrackerEncoder(const TrackerMemory& memory);

  /// Writes at most `budget` bytes of sections, fills in frame.delta and returns the corrected slots,
  /// ascending. Changes nothing else.
  std::span<const Slot> encode(const TrackerFrame& frame, const State& target, std::size_t budget,
                               ByteWriter& out);

 private:
  /// A body that must be corrected, while a budget limits how many are.
  struct Candidate {
    std::uint64_t error = 0;  // squared
    Slot slot = 0;
    std::int32_t cost = kNoCost;  // estimated: what it adds to its block if the block is sent
    bool is_open = true;          // its steps are not chosen yet
    bool is_of_use = false;
    bool is_sent = false;
    TrackerTurningCorrection correction{};
  };
  /// A block's part of candidates_.
  struct Part {
    std::uint32_t candidates = 0;
    std::int64_t cost = 0;   // estimated: the block's header, and all flags as zeros
    std::uint32_t sent = 0;  // bodies sent by the current cut
  };
  /// The worth of an error in bits.
  struct Worth {
    explicit Worth(std::int32_t threshold);
    ErrorWorth moving, at_rest;
  };
  struct Ranked {
    std::uint64_t urgency;
    std::uint32_t index;                         // of candidates_
    bool operator<(const Ranked& other) const {  // the most urgent first
      return urgency != other.urgency ? urgency > other.urgency : index < other.index;
    }
  };

  // Estimated costs are in 1/256 bits, as in TrackerCosts.
  static constexpr std::int32_t kNoCost = INT32_MIN;
  static constexpr std::size_t kTooLarge = SIZE_MAX;

  /// Lists the slots of a block that may be corrected in frame.delta, as its corrected ones.
  void gather(const TrackerFrame& frame, const State& target, const Block& block);
  /// Calls found(slot, error squared) for the bodies of a block whose error is above `early`.
  template <class Found>
  void scan(const TrackerFrame& frame, const State& target, const Block& block, std::int32_t early,
            const Found& found);
  /// Chooses the corrections of the slots that gather() listed, and drops those without use. Models are the
  /// same for a whole delta, so the choice does not depend on what else is sent.
  void choose(const TrackerFrame& frame, const State& target, const Block& block);
  /// Chooses the correction of one body. Returns whether it leaves the body within the threshold.
  bool choose(const TrackerFrame& frame, const State& target, const Worth& worth, Slot slot,
              TrackerTurningCorrection& correction) const;
  void choose(const TrackerFrame& frame, const State& target, const Worth& worth, Candidate& candidate) const;
  /// The squared error of a body, as gather() finds it.
  [[nodiscard]] static std::uint64_t error_of(const TrackerFrame& frame, const State& target, Slot slot);
  [[nodiscard]] static bool is_beyond(const TrackerFrame& frame, const State& target, const Worth& worth,
                                      Slot slot) {
    return error_of(frame, target, slot) > worth.moving.limit;
  }

  /// Writes the code streams of all blocks, with the corrections in frame.delta. Returns the bytes of their
  /// sections.
  std::size_t write(const TrackerFrame& frame);
  /// Does the same after gather() and choose().
  std::size_t choose_and_write(const TrackerFrame& frame, const State& target);
  [[nodiscard]] std::size_t size_bytes(const TrackerFrame& frame) const;
  /// Calls job(blocks) for all blocks, one or two at a time, perhaps on several threads.
  template <class Job>
  void for_each_pair(const TrackerFrame& frame, const Job& job) const;

  // Under a budget: encoder_budget.cpp.
  /// Sends as many of the most urgent bodies as fit. Returns true if all of them and the early ones fit.
  /// `chosen`: the corrections are; otherwise only the slots were listed.
  bool write_most_urgent(const TrackerFrame& frame, const State& target, std::size_t budget, bool chosen);
  /// Makes candidates_ of what frame.delta has.
  void collect(const TrackerFrame& frame, const State& target, const Block& block, bool chosen);
  /// Fills order_ with the bodies that must go, and the costs of parts_.
  void rank(const TrackerFrame& frame);
  struct Cut {
    std::uint32_t count;
    std::int64_t cost;
  };
  /// Estimates how many of the most urgent bodies, `first` .. `last` but at least one, cost at most `most`.
  /// Afterwards order_ starts with them, the least urgent of them last. Before the call order_ must already
  /// be partitioned in this way at `first` and at `last`.
  Cut cut(const TrackerFrame& frame, const State& target, std::uint32_t first, std::uint32_t last,
          std::int64_t most);
  /// The cost that order_[first, last) adds to a cut.
  std::int64_t add(const TrackerFrame& frame, const State& target, std::uint32_t first, std::uint32_t last);
  std::int64_t remove(std::uint32_t first, std::uint32_t last);
  [[nodiscard]] std::int32_t cost(const TrackerFrame& frame, const Candidate& candidate) const;
  /// Writes the code streams of all blocks with the first `count` bodies of order_. Returns the bytes of
  /// their sections.
  std::size_t write_first(const TrackerFrame& frame, std::uint32_t count);
  /// Lists the corrections of a block's candidates in frame.delta: all, or those that are marked as sent.
  void list(const TrackerFrame& frame, const Block& block, bool all) const;
  void remember_waiting(const TrackerFrame& frame);

  std::vector<BlockStream> streams_;   // by block
  std::vector<Part> parts_;            // by block
  std::vector<std::uint8_t> waiting_;  // frames that a body has been beyond the threshold and not corrected
  // Each block's from the index of its first slot on, ascending, and the bodies that must go. Both are made
  // when a budget limits a frame for the first time.
  std::vector<Candidate> candidates_;
  std::vector<Ranked> order_;
  bool some_wait_ = false;
  TrackerCosts costs_;
  Stillness stillness_;
  Suspects suspects_;
};

}  // namespace tandem
