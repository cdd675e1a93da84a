#pragma once
// What an encoder tells those who measure or steer it.

#include <array>
#include <cstdint>
#include <span>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/parameters.hpp"

namespace tandem {

/// What corrections say of a filter's gains: sums of cosines in 1/kCosineOne. Positive: more of it is wanted.
struct GainEvidence {
  static constexpr std::int64_t kCosineOne = std::int64_t{1} << 30;
  std::int64_t agreement = 0;    ///< of corrections with the one before: of v
  std::uint64_t repeated = 0;    ///< corrections in it
  std::int64_t forwardness = 0;  ///< of corrections with c: of what is kept of c
  std::uint64_t driven = 0;      ///< corrections in it
  void add(const GainEvidence& more) {
    agreement += more.agreement;
    repeated += more.repeated;
    forwardness += more.forwardness;
    driven += more.driven;
  }
};

/// Gets each frame that is encoded, in integers, from the thread that encodes it. Changes no byte. What is
/// passed is valid during the call.
class EncodeObserver {
 public:
  virtual ~EncodeObserver() = default;
  /// The frame before its corrections; `predicted` has the lifecycle records applied.
  virtual void frame(const State& /*predicted*/, const State& /*target*/,
                     const CodecParameters& /*parameters*/) {}
  /// Codecs with adaptive contexts, where anything was corrected. By context: the probability of a one that
  /// its decisions had, in 1/65536, and how many zeros and ones there were.
  virtual void decided(std::span<const std::uint16_t> /*p1*/,
                       std::span<const std::array<std::uint32_t, 2>> /*seen*/) {}
  /// Codecs with gains.
  virtual void steered(const GainEvidence& /*evidence*/) {}
};

}  // namespace tandem
