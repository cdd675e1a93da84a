#pragma once
// The tracker's encoder: which bodies to correct and by which of the points inside the error ball. Nothing
// here is on the wire.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/tracker/tracker.hpp"

namespace tandem {

/// What the encoder keeps to, as to a budget. Bodies that all jump at once take about a third of it.
inline constexpr std::size_t kMostTrackerBytesPerBody = 24;
inline constexpr std::size_t kTrackerSlackBytes = 64;

/// What decisions would cost, in 1/256 bits: of each model a zero and a one.
struct TrackerCosts {
  void learn(const TrackerModels& models);
  std::array<std::array<std::uint16_t, 2>, TrackerModelIndex::kDead> of{};
};

struct ErrorWorth;

class TrackerSearch {
 public:
  explicit TrackerSearch(std::uint32_t capacity);

  /// Writes at most `budget` bytes of sections; leaves bodies, steps and counts in `tracker` as parse_end()
  /// would.
  void encode(Tracker& tracker, const State& target, std::size_t budget, ByteWriter& out);

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
    TrackerSteps steps{};
  };
  /// A block's share of candidates_, and of bytes_.
  struct Part {
    std::uint32_t candidates = 0;
    std::size_t first_byte = 0, coded_bytes = 0;
    bool fits = true;
    std::int64_t cost = 0;   // estimated: its header and all flags as zeros
    std::uint32_t sent = 0;  // by the cut at hand
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
  void gather(Tracker& tracker, const State& target, const Block& block);
  /// Steps of a block's candidates that have none yet. Models are the same for a whole delta, so the choice
  /// does not depend on what else is sent.
  void choose(const Tracker& tracker, const State& target, const Block& block);
  void choose(const Tracker& tracker, const State& target, const ErrorWorth& worth, Candidate& candidate);

  /// Sends as many of the most urgent bodies as fit. True: all of them, and the early ones.
  bool write_most_urgent(Tracker& tracker, const State& target, std::size_t budget);
  /// Fills order_ with the bodies that must go, and the costs of parts_.
  void rank(Tracker& tracker);
  struct Cut {
    std::uint32_t count;
    std::int64_t cost;
  };
  /// How many of the most urgent bodies, `first` .. `last` but at least one, seem to cost at most `most`.
  /// order_ then starts with them, the least urgent of them last; with `first` and `last` it does so already.
  Cut cut(const Tracker& tracker, const State& target, std::uint32_t first, std::uint32_t last,
          std::int64_t most);
  /// What order_[first, last) adds to a cut.
  std::int64_t add(const Tracker& tracker, const State& target, std::uint32_t first, std::uint32_t last);
  std::int64_t remove(std::uint32_t first, std::uint32_t last);
  [[nodiscard]] std::int32_t cost(const Tracker& tracker, const Candidate& candidate) const;

  /// Code streams of all blocks with the first `count` of order_. Returns the bytes of their sections.
  std::size_t write_first(Tracker& tracker, std::uint32_t count);
  /// Likewise, with all candidates if `all`, else with those that are marked as sent.
  std::size_t write(Tracker& tracker, bool all);
  void write_block(Tracker& tracker, const Block& block, bool all);
  void remember_waiting(const Tracker& tracker);

  std::vector<Candidate> candidates_;  // of each block from its first slot on, ascending
  std::vector<Part> parts_;            // by block
  std::vector<std::byte> bytes_;       // of each block from its first_byte on
  std::vector<Ranked> order_;
  std::vector<std::uint8_t> waiting_;  // frames that a body was beyond the threshold and not corrected
  std::vector<std::uint8_t> marks_;
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
