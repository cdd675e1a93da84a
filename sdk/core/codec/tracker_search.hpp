#pragma once
// The tracker's encoder: which bodies to correct and by which of the points inside the error ball. Nothing
// here is on the wire.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/tracker.hpp"

namespace tandem {

/// What the encoder keeps to, as to a budget. Bodies that all jump at once take about a third of it.
inline constexpr std::size_t kMostTrackerBytesPerBody = 24;
inline constexpr std::size_t kTrackerSlackBytes = 64;

/// What decisions would cost, in 1/256 bits: of each model a zero and a one.
struct TrackerCosts {
  void learn(const TrackerModels& models);
  std::array<std::array<std::uint16_t, 2>, TrackerModelIndex::kDead> of{};
};

class TrackerSearch {
 public:
  explicit TrackerSearch(std::uint32_t capacity);

  /// Writes at most `budget` bytes of sections; leaves bodies, steps and counts in `tracker` as parse_end()
  /// would.
  void encode(Tracker& tracker, const State& target, std::size_t budget, ByteWriter& out);

 private:
  /// A body that may be corrected, and how.
  struct Candidate {
    std::uint64_t error = 0;  // squared
    Slot slot = 0;
    std::uint32_t rank = 0;  // among those that must go, the most urgent first
    bool must = false;       // beyond the threshold
    TrackerSteps steps{};
  };
  /// A block's share of candidates_, and of bytes_.
  struct Part {
    std::uint32_t candidates = 0;
    std::uint32_t must = 0;
    std::size_t first_byte = 0, coded_bytes = 0;
    bool fits = true;
  };

  /// Candidates of a block with their steps. Models are the same for a whole delta, so the choice does not
  /// depend on what else is sent.
  void choose(Tracker& tracker, const State& target, const Block& block);
  void rank();
  /// Code streams of all blocks with the bodies of rank < limit, and early ones if `early`. False: beyond
  /// budget.
  bool write(Tracker& tracker, std::uint32_t limit, bool early, std::size_t budget);
  void write_block(Tracker& tracker, const Block& block, std::uint32_t limit, bool early);
  void remember_waiting(const Tracker& tracker);

  std::vector<Candidate> candidates_;  // of each block from its first slot on, ascending
  std::vector<Part> parts_;            // by block
  std::vector<std::byte> bytes_;       // of each block from its first_byte on
  std::vector<std::uint64_t> order_;
  std::vector<std::uint8_t> waiting_;  // frames that a body was beyond the threshold and not corrected
  std::vector<std::uint8_t> marks_;
  std::uint32_t must_ = 0;
  bool some_wait_ = false;
  TrackerCosts costs_;
};

/// What an error costs beside bits, for one threshold: worked out once, because it takes a long division.
struct ErrorWorth {
  explicit ErrorWorth(std::int32_t e);
  std::int64_t threshold;
  std::uint64_t limit;  ///< threshold squared
  unsigned shift;       ///< limit >> shift has at most 24 bits
  std::uint64_t worth;  ///< (error^2 >> shift) * worth >> 24: in 1/256 bits
};

/// Steps that correct `to` - `from` (lattice units) at least cost: of the eight points around it that leave
/// an error of at most the threshold, the one with the least bits + 14 * (error / threshold)^2. False: none
/// does; `steps` is then the nearest.
bool choose_steps(const Vec3i& from, const Vec3i& to, const TrackerSteppings& steppings,
                  const ErrorWorth& worth, const TrackerCosts& costs, const TrackerContext& context,
                  TrackerSteps& steps);

}  // namespace tandem
