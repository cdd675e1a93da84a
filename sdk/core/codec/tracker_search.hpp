#pragma once
// The tracker's encoder: which bodies to correct and by which of the points inside the error ball. Nothing
// here is on the wire.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/tracker.hpp"

namespace tandem {

class TrackerSearch {
 public:
  explicit TrackerSearch(std::uint32_t capacity);

  /// Writes at most `budget` bytes of sections; leaves bodies, steps and coder states in `tracker` as parse()
  /// would.
  void encode(Tracker& tracker, const State& target, std::int32_t threshold, std::size_t budget,
              ByteWriter& out);

 private:
  struct Candidate {
    std::uint64_t error = 0;  // squared
    Slot slot = 0;
    std::uint32_t rank = 0;  // among those that must go, the most urgent first
    bool must = false;       // beyond the threshold
  };

  void scan(const State& predicted, const State& target, std::int32_t threshold);
  void rank();
  /// Sections of all blocks with the bodies of rank < limit, and early ones if `early`. False: beyond budget.
  bool write(Tracker& tracker, const State& target, std::uint32_t limit, bool early, std::span<std::byte> out,
             std::size_t& size_bytes);
  bool write_block(Tracker& tracker, const State& target, const Block& block, std::size_t& at,
                   std::uint32_t limit, bool early, std::span<std::byte> out, std::size_t& size_bytes);
  void remember_waiting(const Tracker& tracker);

  std::vector<Candidate> candidates_;  // ascending by slot
  std::vector<std::uint32_t> order_;
  std::vector<std::uint8_t> waiting_;  // frames that a body was beyond the threshold and not corrected
  std::vector<std::uint8_t> waiting_next_;
  std::vector<std::uint8_t> marks_;
  std::uint32_t must_ = 0;
  std::int32_t threshold_ = 1;
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
                  const ErrorWorth& worth, const TrackerModels& models, const TrackerContext& context,
                  TrackerSteps& steps);

}  // namespace tandem
