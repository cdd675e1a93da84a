#pragma once
// One stream: what becomes of the engine's bodies in a frame, up to the payload that travels. The host
// publishes it; `tandem bench` measures it.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sdk/core/timeline/timeline.hpp"
#include "services/host/gains.hpp"
#include "services/host/lattice_choice.hpp"
#include "services/host/quality.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

struct StreamConfig {
  Layout layout;                       ///< capacity: that of the bodies
  Lattice lattice;                     ///< of the session, so the same for all of its streams
  std::size_t budget = kNoBudget;      ///< bytes of a frame; spawns and parameters go first
  std::optional<QualityGoal> quality;  ///< empty: threshold and steps change only by set_parameters()
  std::optional<GainGoal> gains;       ///< empty: so do decay and gains
  LocalOptions local;
};

/// Sets the decay and gains of the first frame, and what the later ones aim at, for a codec that reads them.
/// Errors: those of the layout's predictor.
[[nodiscard]] Result<void> choose_gains(StreamConfig& config);

/// Most bytes a delta of this stream can take: what a transport must be ready for before the host exists.
/// Errors: as Stream::create() for codec and predictor.
[[nodiscard]] Result<std::size_t> largest_delta_bytes(const StreamConfig& config);

/// Where a stream begins: bodies that were not stepped yet.
struct StreamStart {
  engine::Bodies bodies;
  Drive drive;  ///< in force at `frame`
  Epoch epoch = 1;
  Frame frame = 0;
  double frame_rate_hz = 30;  ///< nominal; automatic quality counts in it
};

/// Puts bodies on the lattice, predicts, encodes and applies, one frame at a time, and chooses the parameters
/// of the next. Owns no thread, clock or socket; the same calls give the same bytes. Not thread-safe.
class Stream {
 public:
  /// Errors: kInvalidArgument (layout, goals, body columns not `capacity` long, orientations in the layout
  /// that the bodies do not have), kUnsupported (codec, predictor), kMalformed (tables, constants).
  static Result<Stream> create(StreamConfig config, const StreamStart& start);
  Stream(Stream&&) noexcept;
  Stream& operator=(Stream&&) noexcept;
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream();

  /// Numbers must follow one another and frames lie in the future. Errors: as ServerTimeline::schedule().
  [[nodiscard]] Result<void> schedule(const ScheduledDrive& input);

  /// Of one frame; spans stay valid until the next.
  struct FrameResult : ServerTimeline::FrameResult {
    std::span<const LifecycleRecord> lifecycle;  ///< records in the payload
    std::int64_t mirror_ns = 0;                  ///< putting the bodies on the lattice; 0 without a clock
  };
  /// That a frame can be made of these. Errors: kInvalidArgument (columns not as long as the stream's
  /// capacity).
  [[nodiscard]] Result<void> check(const engine::Bodies& bodies) const;
  /// The next frame, from the bodies after a step, that check() takes, and what happened to their slots in
  /// it; tells `observer`, if any. Allocates nothing after the first few frames.
  FrameResult produce(const engine::Bodies& bodies, std::span<const engine::Event> events,
                      EncodeObserver* observer = nullptr);

  /// The next frame is rounded, so that a snapshot cut right after it is smaller. Does nothing with
  /// codecs whose corrections would leave few bodies round: CodecTraits::keeps_rounding.
  void round_next();
  /// One cut right after frame(), for joiners. Replaces the content of `out`.
  void snapshot(std::vector<std::byte>& out);

  /// In force from the next frame on; travels in that frame's delta. With gain goals, gains stay so until the
  /// next decision. Errors: kInvalidArgument (out of range, or automatic quality decides).
  [[nodiscard]] Result<void> set_parameters(const StreamParameters& parameters);
  [[nodiscard]] const StreamParameters& parameters() const;  ///< of the next frame
  [[nodiscard]] double threshold_m() const;                  ///< of the next frame, scene units
  /// Automatic quality is above its target although the threshold is the largest permitted.
  [[nodiscard]] bool target_out_of_reach() const;

  /// For measurement only: a monotonic clock in nanoseconds.
  void set_clock(std::int64_t (*now_ns)());
  /// What a client spends on predicted step and hash of agreed(), ns per body: the median of nine on this
  /// machine, on one thread. 0 without a clock or a body. Changes nothing.
  [[nodiscard]] std::uint32_t measure_client_cost() const;

  [[nodiscard]] const StreamConfig& config() const;
  [[nodiscard]] Frame frame() const;               ///< of the last delta
  [[nodiscard]] const State& agreed() const;       ///< client state at frame()
  [[nodiscard]] std::uint64_t hash() const;        ///< of agreed()
  [[nodiscard]] std::uint64_t last_input() const;  ///< highest number scheduled
  [[nodiscard]] std::uint32_t bodies() const;      ///< alive in agreed()
  /// Bodies that it could not show as the engine had them: not finite, off the lattice, no orientation.
  [[nodiscard]] engine::Mishaps mishaps() const;
  [[nodiscard]] std::size_t payload_bound() const;
  [[nodiscard]] std::size_t snapshot_bound() const;

 private:
  struct Impl;
  explicit Stream(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::host
