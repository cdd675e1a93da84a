#pragma once
// The tracker's encoder: which bodies to correct. By how much is in steps.hpp. Nothing here is on the wire.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/codec/tracker/frame.hpp"
#include "sdk/core/codec/tracker/steps.hpp"
#include "sdk/core/codec/tracker/stillness.hpp"

namespace tandem {

/// What the encoder keeps to, as to a budget. Bodies that all jump at once take about a third of it.
[[nodiscard]] constexpr std::size_t most_tracker_bytes_per_body(bool turns) { return turns ? 48 : 24; }
inline constexpr std::size_t kTrackerSlackBytes = 64;
/// Most bytes of sections for a capacity.
[[nodiscard]] constexpr std::size_t tracker_bound(std::uint32_t capacity, bool turns) {
  return block_count(capacity) * (kMostSectionHeaderBytes + kMostBlockNumberBytes + kTrackerSlackBytes) +
         most_tracker_bytes_per_body(turns) * capacity;
}

/// Keeps, beside scratch memory, how long each body has waited for its correction, and where it was.
class TrackerEncoder {
 public:
  /// `memory` outlives it.
  explicit TrackerEncoder(const TrackerMemory& memory);

  /// Writes at most `budget` bytes of sections, fills in frame.delta and returns the corrected slots,
  /// ascending; changes nothing else.
  std::span<const Slot> encode(const TrackerFrame& frame, const State& target, std::size_t budget,
                               ByteWriter& out);

 private:
  /// A body that may be corrected, and how.
  struct Candidate {
    enum class Steps : std::uint8_t { kOpen, kFound, kUseless };
    std::uint64_t error = 0;  // squared
    Slot slot = 0;
    std::int32_t cost = kNoCost;  // estimated: what it adds to its block, if that is sent
    Steps state = Steps::kOpen;
    bool must = false;  // beyond the threshold
    bool is_sent = false;
    TrackerCorrection correction{};
  };
  /// A block's share of candidates_, and of bytes_.
  struct Part {
    std::uint32_t candidates = 0;
    std::size_t first_byte = 0, coded_bytes = 0;
    bool fits = true;
    std::int64_t cost = 0;   // estimated: its header and all flags as zeros
    std::uint32_t sent = 0;  // by the cut at hand
  };
  /// What an error is worth beside bits.
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

  /// Candidates of a block without their steps.
  void gather(const TrackerFrame& frame, const State& target, const Block& block);
  /// Calls found(slot, error squared) for the bodies of a block that are off by more than `early`.
  template <class Found>
  void scan(const TrackerFrame& frame, const State& target, const Block& block, std::int32_t early,
            const Found& found);
  /// Steps of a block's candidates that have none yet. Models are the same for a whole delta, so the choice
  /// does not depend on what else is sent.
  void choose(const TrackerFrame& frame, const State& target, const Block& block);
  void choose(const TrackerFrame& frame, const State& target, const Worth& worth, Candidate& candidate);

  /// Sends as many of the most urgent bodies as fit. True: all of them, and the early ones.
  bool write_most_urgent(const TrackerFrame& frame, const State& target, std::size_t budget);
  /// Fills order_ with the bodies that must go, and the costs of parts_.
  void rank(const TrackerFrame& frame);
  struct Cut {
    std::uint32_t count;
    std::int64_t cost;
  };
  /// How many of the most urgent bodies, `first` .. `last` but at least one, seem to cost at most `most`.
  /// order_ then starts with them, the least urgent of them last; with `first` and `last` it does so already.
  Cut cut(const TrackerFrame& frame, const State& target, std::uint32_t first, std::uint32_t last,
          std::int64_t most);
  /// What order_[first, last) adds to a cut.
  std::int64_t add(const TrackerFrame& frame, const State& target, std::uint32_t first, std::uint32_t last);
  std::int64_t remove(std::uint32_t first, std::uint32_t last);
  [[nodiscard]] std::int32_t cost(const TrackerFrame& frame, const Candidate& candidate) const;

  /// Code streams of all blocks with the first `count` of order_. Returns the bytes of their sections.
  std::size_t write_first(const TrackerFrame& frame, std::uint32_t count);
  /// Likewise, with all candidates if `all`, else with those that are marked as sent.
  std::size_t write(const TrackerFrame& frame, bool all);
  void write_block(const TrackerFrame& frame, const Block& block, bool all);
  void remember_waiting(const TrackerFrame& frame);

  std::vector<Candidate> candidates_;  // of each block from its first slot on, ascending
  std::vector<Part> parts_;            // by block
  std::vector<std::byte> bytes_;       // of each block from its first_byte on
  std::vector<Ranked> order_;
  std::vector<std::uint8_t> waiting_;  // frames that a body was beyond the threshold and not corrected
  std::vector<std::uint8_t> marks_;
  bool some_wait_ = false;
  TrackerCosts costs_;
  Stillness stillness_;
};

}  // namespace tandem
