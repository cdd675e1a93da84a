#pragma once
// Measures what streams would cost that nobody plays: it makes them for a while without publishing them.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "services/host/frames/frame_source.hpp"
#include "services/host/streams/mirror.hpp"
#include "services/host/streams/stream.hpp"

namespace tandem::host {

/// Tries the streams that are not made, one after the other: each is made beside the others for some seconds,
/// and its bytes are compared with those of the first stream that is made. A round of trials begins soon
/// after the start, and again when that stream's bytes a frame are others than in the last round. A trial
/// that takes too much of a frame's time is given up. Changes nothing of the streams that are made. Owns no
/// clock; not thread-safe.
class Trials {
 public:
  /// Frames before the first round; frames in which a stream learns, and in which it is measured.
  static constexpr std::uint32_t kFirst = 30, kLearning = 90, kMeasured = 90;
  /// Frames between the end of a round and the next one: at least, and at most.
  static constexpr std::uint32_t kLeastPause = 600, kMaxPause = 9000;
  /// By what factor the bytes of a frame must have changed for a new round.
  static constexpr double kOtherNature = 1.5;
  /// Largest part of a frame's period that a trial may take in the mean of its frames.
  static constexpr double kMaxShare = 0.25;

  /// `clock_ns`: null for trials that may take any time.
  Trials(std::uint32_t streams, double frame_rate_hz, std::int64_t (*clock_ns)());

  using Begin = std::function<Result<Stream>(std::uint32_t stream)>;
  /// Call after each frame, before the next is begun. `made`: the frame's deltas, at least one, with the
  /// payloads. `begin` begins a stream at the frame that was made.
  void after_frame(const Mirror& mirror, std::span<const MadeDelta> made, const Begin& begin);
  /// An input was scheduled.
  void schedule(const ScheduledDrive& input);

  /// The bytes a frame that a stream would take now, as far as that is known: 0 if not.
  [[nodiscard]] double bytes_per_frame(std::uint32_t stream) const;
  /// The bytes a frame of the stream that the trials are compared with.
  [[nodiscard]] double reference_bytes() const { return mean_bytes_; }
  [[nodiscard]] std::uint32_t reference() const { return reference_; }
  [[nodiscard]] bool too_slow(std::uint32_t stream) const { return figures_[stream].is_too_slow; }
  /// True once for each round that ended: bytes_per_frame() is new then.
  [[nodiscard]] bool take_end() { return std::exchange(has_ended_, false); }

 private:
  struct Figures {
    double ratio = 0;          // its bytes over those of the reference; 0: unknown
    bool is_too_slow = false;  // for this server
  };
  struct Trial {
    std::uint32_t stream = 0;
    Stream shadow;
    std::uint32_t frames = 0;
    std::size_t bytes = 0, reference_bytes = 0;
    std::int64_t took_ns = 0;
  };

  void follow_reference(const MadeDelta& first);
  /// Begins a round where one is due.
  void consider_round();
  /// Begins the trial of the next stream of the round, or ends the round.
  void next_trial(std::span<const MadeDelta> made, const Begin& begin);
  void measure(const Mirror& mirror, const MadeDelta& first);

  double period_ns_;
  std::int64_t (*clock_ns_)();
  std::vector<Figures> figures_;  // by stream
  std::uint32_t reference_ = 0;   // the first stream that is made
  double mean_bytes_ = 0;         // a frame of it takes
  std::uint32_t mean_of_ = 0;     // frames in that mean, up to kMeasured
  double mean_then_ = 0;          // as it was at the end of the last round; 0: not known
  std::uint32_t paused_ = 0;      // frames since the last round, or since the start
  bool is_first_ = true;
  bool has_ended_ = false;
  std::optional<std::uint32_t> next_;  // the stream to try next; empty: no round
  std::optional<Trial> trial_;
};

}  // namespace tandem::host
