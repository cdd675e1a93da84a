#pragma once
// Several frames of a stream in one delta: idl/PROTOCOL.md, "Several frames".

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/messages.hpp"

namespace tandem::transport {

/// One frame, or consecutive frames with the same hash and empty payloads.
struct FrameRun {
  Frame last = 0;
  std::uint32_t before = 0;  ///< frames of the run in front of `last`; 0 with a payload
  std::uint64_t hash = 0;    ///< of all of them
  std::span<const std::byte> payload = {};
};

/// The runs of a whole delta, ascending. Together they are the frames `frame - earlier` to `frame`. Payloads
/// point into that of the delta. Empty: the delta breaks the format. Untrusted.
[[nodiscard]] std::vector<FrameRun> read_frames(const DeltaMessage& delta);

/// When a frame that the delta tells was made, by the delta's stamp and the nominal rate. Stamps are
/// untrusted: the difference may wrap.
[[nodiscard]] constexpr std::int64_t made_ns(const DeltaMessage& delta, Frame frame, std::int64_t period_ns) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(delta.server_time_ns) -
                                   (delta.frame - frame) * static_cast<std::uint64_t>(period_ns));
}

/// Collects frames for one delta. Not thread-safe.
class FrameBundle {
 public:
  /// Takes the frame that follows the last one.
  void add(Frame frame, std::uint64_t hash, std::span<const std::byte> payload);
  [[nodiscard]] bool empty() const { return runs_.empty(); }
  [[nodiscard]] std::uint32_t frames() const { return frames_; }
  [[nodiscard]] Frame last() const {
    TANDEM_ASSERT(!empty());
    return runs_.back().last;
  }
  /// Maximum size of the payload of the delta that one more frame of `payload_bytes` would give.
  [[nodiscard]] std::size_t bytes_with(std::size_t payload_bytes) const;
  /// The delta of all frames that were added, part 0 of 1, which then are gone. Epoch, stream, last_input and
  /// server_time_ns are left to the caller.
  [[nodiscard]] DeltaMessage take();

 private:
  struct Run {
    Frame last = 0;
    std::uint32_t before = 0;
    std::uint64_t hash = 0;
    std::size_t begin = 0, bytes = 0;  // of its payload in payloads_
  };
  std::vector<Run> runs_;
  Bytes payloads_;
  std::uint32_t frames_ = 0;
};

}  // namespace tandem::transport
