#pragma once
// Holds back the deltas of frames in which nothing changed.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "sdk/core/layout/layout.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::host {

/// Of one stream: which frames are told by a later delta. A frame is quiet if its payload is empty and its
/// state hash is that of the frame before; so one delta can tell any number of them (idl/STATES.md, "Quiet
/// frames"). Not thread-safe.
class QuietFrames {
 public:
  /// Time after which a delta tells the quiet frames, as a sign of life.
  static constexpr std::int64_t kLongestNs = kSecond;

  /// Consecutive quiet frames.
  struct Run {
    Frame last = 0;
    std::uint32_t before = 0;  ///< frames of the run in front of `last`
    std::uint64_t hash = 0;    ///< of all of them
    std::uint64_t last_input = 0;
  };
  struct Made {
    Frame frame = 0;
    std::uint64_t hash = 0;
    std::uint64_t last_input = 0;
    std::size_t bytes = 0;  ///< of the payload
  };

  /// `most`: maximum frames in front of the last one of a run.
  explicit QuietFrames(std::uint32_t most) : most_(most) {}

  /// Takes a frame that was made. Returns true if its own delta is sent now, behind that of release(); false
  /// if it is part of the run.
  [[nodiscard]] bool take(const Made& made);
  /// The run that is to be told now, which then is over. `all`: whatever it holds, because a delta follows or
  /// there are no more frames.
  [[nodiscard]] std::optional<Run> release(bool all, std::int64_t now_ns);
  /// A delta was sent.
  void sent(std::int64_t now_ns) { told_ns_ = now_ns; }

 private:
  std::uint32_t most_;
  std::optional<Made> before_;  // the last frame that was taken
  std::optional<Run> held_;
  std::int64_t told_ns_ = 0;
};

}  // namespace tandem::host
