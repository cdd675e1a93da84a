#pragma once
// The interface of an observer that measures or steers an encoder.

#include <array>
#include <cstdint>
#include <span>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/parameters.hpp"

namespace tandem {

/// Evidence of corrections about a filter's gains: sums of cosines in 1/kCosineOne. A positive sum asks for
/// more gain.
struct GainEvidence {
  static constexpr std::int64_t kCosineOne = std::int64_t{1} << 30;
  std::int64_t agreement = 0;    ///< of corrections with the previous one; for the gain of v
  std::uint64_t repeated = 0;    ///< number of corrections in the sum
  std::int64_t forwardness = 0;  ///< of corrections with c; for the part of c that is kept
  std::uint64_t driven = 0;      ///< number of corrections in the sum
  void add(const GainEvidence& more) {
    agreement += more.agreement;
    repeated += more.repeated;
    forwardness += more.forwardness;
    driven += more.driven;
  }
};

/// Receives each frame that is encoded, in integers, in the thread that encodes it. It changes no byte. The
/// arguments are valid during the call.
class EncodeObserver {
 public:
  virtual ~EncodeObserver() = default;
  /// The frame before its corrections; `predicted` has the lifecycle records applied.
  virtual void frame(const State& /*predicted*/, const State& /*target*/,
                     const CodecParameters& /*parameters*/) {}
  /// Called by codecs with adaptive contexts if anything was corrected. For each context: the probability of
  /// a one that its decisions had, in 1/65536, and the numbers of zeros and ones.
  virtual void decided(std::span<const std::uint16_t> /*p1*/,
                       std::span<const std::array<std::uint32_t, 2>> /*seen*/) {}
  /// Called by codecs with gains.
  virtual void steered(const GainEvidence& /*evidence*/) {}
};

}  // namespace tandem
