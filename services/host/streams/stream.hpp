#pragma once
// One stream: turns the bodies that a mirror shows in a frame into the payload that travels. The host
// publishes it; `tandem bench` measures it.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/core/timeline/timeline.hpp"
#include "services/host/streams/frame_budget.hpp"
#include "services/host/streams/gains.hpp"
#include "services/host/streams/lattice_choice.hpp"
#include "services/host/streams/mirror.hpp"
#include "services/host/streams/quality.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

/// When clients are told of a stream. As trials show, it pays if it takes less than three quarters of the
/// bytes of the best of the others that are offered (kWhileItPays: that are always), and does not pay any
/// more when one that is always takes less than three quarters of its own and nobody plays it.
enum class Offered : std::uint8_t {
  kAlways,
  kWhileItPays,  ///< at first, too
  kOnceItPays,   ///< and while it pays; not before
};

struct StreamConfig {
  std::string name;                    ///< see check_stream_names(); empty: no name
  Layout layout;                       ///< the capacity is that of the bodies
  Lattice lattice;                     ///< the session's, so the same for all its streams
  std::size_t budget = kNoBudget;      ///< maximum bytes of a frame; spawns and parameters go first
  std::optional<QualityGoal> quality;  ///< empty: threshold and steps change only by set_parameters()
  std::optional<GainGoal> gains;       ///< empty: decay and gains change only by set_parameters()
  std::uint32_t delay_ms = 0;          ///< see DeltaCollector; at most kMaxDelayMs
  std::uint32_t cap_kbit_s = 0;        ///< see WireCap; 0: none. The threshold follows it with `quality`
  Offered offered = Offered::kAlways;  ///< of the first of a session's streams always
  bool has_data = true;    ///< where the session has data of bodies, and its layout has their fields
  double data_kbit_s = 0;  ///< rate of data of bodies, above which changes wait; 0: none waits
  LocalOptions local;      ///< streams share no threads, because they run in parallel
};

/// True if both give the same deltas: they differ in name and delay at most.
[[nodiscard]] bool same_encoding(const StreamConfig& a, const StreamConfig& b);

/// Offers of one stream have its name, give the same deltas, and differ in their delay. The first of them
/// encodes; the other carries its frames.
inline constexpr std::size_t kMaxDelays = 2;

/// The index of the offer whose frames `offer` carries: its own if it encodes.
[[nodiscard]] std::uint32_t encoding_offer(std::span<const StreamConfig> offers, std::size_t offer);
/// The number of offers that encode; they stand first.
[[nodiscard]] std::uint32_t encoding_offers(std::span<const StreamConfig> offers);

/// Checks the offers of a session. Names have 1 to 32 characters of [a-z0-9_-]. The names auto, bandwidth,
/// computing and error are not allowed, because clients use them as preferences. A single stream needs no
/// name. What has the name of another is an offer of the same stream, of which there are at most kMaxDelays.
/// Errors: kInvalidArgument, also for no offer and for more than 8.
[[nodiscard]] Result<void> check_stream_names(std::span<const StreamConfig> offers);

/// Sets the decay and gains of the first frame and the goal of the later ones, for a codec that reads them.
/// Errors: those of the layout's predictor.
[[nodiscard]] Result<void> choose_gains(StreamConfig& config);

/// Maximum size of a delta of these streams. A transport must be ready for it before the host exists. Errors:
/// as Stream::create() for codec and predictor.
[[nodiscard]] Result<std::size_t> largest_delta_bytes(std::span<const StreamConfig> streams);

/// Makes the mirror of all `streams`, at least one, of a simulation that was not stepped yet. `extent`: as in
/// Mirror. Errors: kInvalidArgument (another lattice, capacity or number of types than the first stream's;
/// body columns not `capacity` long; orientations that the bodies do not have).
[[nodiscard]] Result<Mirror> make_mirror(std::span<const StreamConfig> streams, const engine::Bodies& bodies,
                                         double extent = Mirror::kNoExtent);

/// The state in which a stream begins: what `mirror` shows at `frame`.
struct StreamStart {
  const Mirror& mirror;  ///< has the stream's lattice and capacity, and at least its groups
  Drive drive;           ///< in force at `frame`
  Epoch epoch = 1;
  StreamId id = {};
  Frame frame = 0;
  double frame_rate_hz = 30;                     ///< nominal; automatic quality computes rates with it
  std::uint64_t last_input = 0;                  ///< number of the last input scheduled before the stream
                                                 ///< begins
  std::span<const ScheduledDrive> pending = {};  ///< inputs up to that one that have not acted yet; ascending
  /// The bodies have been moving for a while: bodies that hardly move begin at rest, if the codec supports
  /// that.
  bool under_way = false;
  /// Where they have not: Simulation::moved() of the last step before `frame`. Bodies of blocks that did not
  /// move begin at rest likewise, unless the predicted step computes contacts of few bodies. Empty: unknown.
  std::span<const std::uint8_t> moved = {};
  const SessionWorld* world = nullptr;  ///< at `frame`, where the layout has features; null: an empty one
};

/// Predicts, encodes and applies one frame at a time, and chooses the parameters of the next. Owns no thread,
/// clock or socket; the same calls give the same bytes. Not thread-safe.
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

  /// Schedules an input. Numbers must be consecutive and frames must lie in the future. Errors: as
  /// ServerTimeline::schedule().
  [[nodiscard]] Result<void> schedule(const ScheduledDrive& input);

  /// The result of one frame. Its spans are valid until the next frame.
  struct FrameResult : ServerTimeline::FrameResult {
    std::span<const LifecycleRecord> lifecycle;  ///< records in the payload
  };
  /// Makes the next frame, towards what `mirror` (the one of the start) shows after a step. Tells `observer`,
  /// if there is one. `news`: as in ServerTimeline::advance(). `budget`: besides the configuration's.
  /// Allocates nothing after the first few frames.
  FrameResult produce(const Mirror& mirror, EncodeObserver* observer = nullptr,
                      std::span<const std::byte> news = {}, const FrameBudget& budget = {});

  /// Rounds the next frame, so that a snapshot cut right after it is smaller. Does nothing with codecs whose
  /// corrections would leave few bodies rounded: CodecTraits::keeps_rounding.
  void round_next();
  /// Writes a snapshot for joiners, cut right after frame(). Replaces the content of `out`.
  void snapshot(std::vector<std::byte>& out, std::optional<StreamId> as = {});

  /// Sets parameters from the next frame on; they travel in that frame's delta. With gain goals, gains stay
  /// so until the next decision. Errors: kInvalidArgument (out of range, or automatic quality decides).
  [[nodiscard]] Result<void> set_parameters(const StreamParameters& parameters);
  /// Takes over what a stream of the same layout had learned, from the next frame on: threshold and steps
  /// where automatic quality decides them, decay and gains where they follow the corrections.
  void resume(const StreamParameters& learned);
  [[nodiscard]] const StreamParameters& parameters() const;  ///< of the next frame
  [[nodiscard]] double threshold_m() const;                  ///< of the next frame, scene units
  /// True if automatic quality is above its target, or its cap holds corrections back, although the threshold
  /// is at the permitted maximum.
  [[nodiscard]] bool target_out_of_reach() const;

  /// For measurement only: a monotonic clock in nanoseconds.
  void set_clock(std::int64_t (*now_ns)());
  /// Measures what a client spends on predicted step and hash, ns per body. It uses agreed(), or up to 4,096
  /// made-up bodies while agreed() has none. The result is the median of nine runs on this machine, on one
  /// thread, rounded up; at least 1, or 0 without a clock. Changes nothing.
  [[nodiscard]] std::uint32_t measure_client_cost() const;

  [[nodiscard]] const StreamConfig& config() const;
  [[nodiscard]] Frame frame() const;               ///< frame of the last delta
  [[nodiscard]] const State& agreed() const;       ///< client state at frame()
  [[nodiscard]] std::uint64_t hash() const;        ///< hash of agreed()
  [[nodiscard]] std::uint64_t last_input() const;  ///< highest input number scheduled
  [[nodiscard]] std::uint32_t bodies() const;      ///< bodies alive in agreed()
  [[nodiscard]] std::uint32_t crowded() const;     ///< of the last predicted step: see Predictor
  /// Maximum sizes, at most those that a session may declare. Where a payload could be larger, produce()
  /// corrects fewer bodies; a frame in which millions of bodies appear can still exceed it.
  [[nodiscard]] std::size_t payload_bound() const;
  [[nodiscard]] std::size_t snapshot_bound() const;

 private:
  struct Impl;
  explicit Stream(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::host
