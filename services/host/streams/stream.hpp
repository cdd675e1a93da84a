#pragma once
// One stream: what becomes of the bodies that a mirror shows in a frame, up to the payload that travels. The
// host publishes it; `tandem bench` measures it.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/core/timeline/timeline.hpp"
#include "services/host/streams/gains.hpp"
#include "services/host/streams/lattice_choice.hpp"
#include "services/host/streams/mirror.hpp"
#include "services/host/streams/quality.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

struct StreamConfig {
  std::string name;                    ///< see check_stream_names(); empty: it has none
  Layout layout;                       ///< capacity: that of the bodies
  Lattice lattice;                     ///< of the session, so the same for all of its streams
  std::size_t budget = kNoBudget;      ///< bytes of a frame; spawns and parameters go first
  std::optional<QualityGoal> quality;  ///< empty: threshold and steps change only by set_parameters()
  std::optional<GainGoal> gains;       ///< empty: so do decay and gains
  LocalOptions local;                  ///< streams share no threads: they are made side by side
};

/// Checks the names of a session's streams: each its own, of 1 to 32 characters of [a-z0-9_-], none of auto,
/// bandwidth, computing and error, which clients prefer; a single one needs none. Errors: kInvalidArgument;
/// also for none and for more than 8.
[[nodiscard]] Result<void> check_stream_names(std::span<const StreamConfig> streams);

/// Sets the decay and gains of the first frame, and what the later ones aim at, for a codec that reads them.
/// Errors: those of the layout's predictor.
[[nodiscard]] Result<void> choose_gains(StreamConfig& config);

/// Most bytes a delta of these streams can take: what a transport must be ready for before the host exists.
/// Errors: as Stream::create() for codec and predictor.
[[nodiscard]] Result<std::size_t> largest_delta_bytes(std::span<const StreamConfig> streams);

/// The bodies as all of `streams`, at least one, will show them; not stepped yet. `extent`: as a Mirror's.
/// Errors: kInvalidArgument (another lattice, capacity or number of types than the first stream's; body
/// columns not `capacity` long; orientations that the bodies do not have).
[[nodiscard]] Result<Mirror> make_mirror(std::span<const StreamConfig> streams, const engine::Bodies& bodies,
                                         double extent = Mirror::kNoExtent);

/// Where a stream begins: what `mirror` shows at `frame`.
struct StreamStart {
  const Mirror& mirror;  ///< of the stream's lattice and capacity, with its groups or more
  Drive drive;           ///< in force at `frame`
  Epoch epoch = 1;
  StreamId id = {};
  Frame frame = 0;
  double frame_rate_hz = 30;                     ///< nominal; automatic quality counts in it
  std::uint64_t last_input = 0;                  ///< number of the last scheduled input before it begins
  std::span<const ScheduledDrive> pending = {};  ///< of those up to it, still to act; ascending
  /// The bodies have been moving for a while: those that hardly do begin at rest, where the codec knows that.
  bool under_way = false;
};

/// Predicts, encodes and applies, one frame at a time, and chooses the parameters
/// of the next. Owns no thread, clock or socket; the same calls give the same bytes. Not thread-safe.
class Stream {
 public:
  /// Errors: kInvalidArgument (layout, goals), kUnsupported (codec, predictor), kMalformed (tables,
  /// constants).
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
  };
  /// The next frame, towards what `mirror`, the one of its start, shows after a step; tells `observer`, if
  /// any. Allocates nothing after the first few frames.
  FrameResult produce(const Mirror& mirror, EncodeObserver* observer = nullptr);

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
  /// What a client spends on predicted step and hash of agreed(), or of up to 4,096 made-up bodies while it
  /// has none, ns per body: the median of nine on this machine, on one thread, rounded up. At least 1; 0
  /// without a clock. Changes nothing.
  [[nodiscard]] std::uint32_t measure_client_cost() const;

  [[nodiscard]] const StreamConfig& config() const;
  [[nodiscard]] Frame frame() const;               ///< of the last delta
  [[nodiscard]] const State& agreed() const;       ///< client state at frame()
  [[nodiscard]] std::uint64_t hash() const;        ///< of agreed()
  [[nodiscard]] std::uint64_t last_input() const;  ///< highest number scheduled
  [[nodiscard]] std::uint32_t bodies() const;      ///< alive in agreed()
  [[nodiscard]] std::size_t payload_bound() const;
  [[nodiscard]] std::size_t snapshot_bound() const;

 private:
  struct Impl;
  explicit Stream(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::host
