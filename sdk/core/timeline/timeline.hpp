#pragma once
// The order of frames on both sides: predicted steps, deltas, scheduled inputs, snapshots.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/data/body_data.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/core/layout/layout.hpp"
#include "sdk/core/news/session_world.hpp"
#include "sdk/core/predict/predictor.hpp"

namespace tandem {

/// Options of one side, in addition to the layout. The other side never learns them, and they change no byte.
struct LocalOptions {
  RunBlocks run_blocks;  ///< how this side predicts and codes in parallel; see Predictor and Codec
  /// Server: the predictor for which the encoder makes its choices; empty: the layout's. In a world of one
  /// sub-step `field` steps as `contact`, so it is encoded as `contact`.
  std::string_view encodes_as = {};
};

/// An input that changes the predicted step. `number` counts 1, 2, ... within an epoch.
struct ScheduledDrive {
  std::uint64_t number = 0;
  Frame frame = 0;  ///< acts in the step that produces this frame
  Drive drive;
  friend bool operator==(const ScheduledDrive&, const ScheduledDrive&) = default;
};

/// Maximum number of scheduled inputs that have not acted yet; more are refused (kCapacity).
inline constexpr std::size_t kMaxPendingInputs = 256;

/// The data that bodies shall have on a frame; what does not fit waits: DataQueue.
struct DataTarget {
  std::span<const std::byte> records;  ///< by slot; of dead ones ignored
  std::size_t most_bytes = SIZE_MAX;   ///< of the section's body
};

/// The server's side: predicts, encodes and applies, one frame at a time. Not thread-safe.
class ServerTimeline {
 public:
  /// Errors: kUnsupported, kMalformed, kInvalidArgument (capacity, parameters, lead).
  static Result<ServerTimeline> create(const Layout& layout, Epoch epoch, const LocalOptions& local = {},
                                       StreamId stream = {});
  /// Uses the caller's predictor; the one that `layout` names is ignored.
  static Result<ServerTimeline> create(const Layout& layout, Epoch epoch,
                                       std::unique_ptr<Predictor> predictor, const LocalOptions& local = {},
                                       StreamId stream = {});
  ServerTimeline(ServerTimeline&&) noexcept;
  ServerTimeline& operator=(ServerTimeline&&) noexcept;
  ServerTimeline(const ServerTimeline&) = delete;
  ServerTimeline& operator=(const ServerTimeline&) = delete;
  ~ServerTimeline();

  /// Sets the agreed state at `frame` (frame 0: the start block); call it before the first advance(). For a
  /// session that has run before: `last_input` is the last number issued, `pending` has the inputs up to it
  /// that have not acted yet. `world`: at `frame`, for a session with features; null: an empty one.
  /// `data`: records by slot, for a stream with data; empty: all zero.
  void start(Frame frame, const State& state, const Drive& drive, std::uint64_t last_input = 0,
             std::span<const ScheduledDrive> pending = {}, const SessionWorld* world = nullptr,
             std::span<const std::byte> data = {});
  /// Schedules an input. Numbers must be consecutive and frames must lie in the future. The last number for a
  /// frame wins. Errors: kOutOfOrder, kCapacity, kInvalidArgument (gravity out of range).
  [[nodiscard]] Result<void> schedule(const ScheduledDrive& input);

  struct FrameResult {
    Frame frame = 0;
    std::uint64_t last_input = 0;        ///< highest input number scheduled before this delta
    std::uint64_t hash = 0;              ///< hash of the agreed state
    std::span<const std::byte> payload;  ///< valid until the next advance()
    std::size_t correction_bytes = 0;
    std::uint32_t corrected = 0;
    std::size_t data_bytes = 0;    ///< of the section of data, with its header
    std::size_t data_waiting = 0;  ///< bodies whose newest data are not in it
    /// Durations, filled only with a clock: set_clock(). Encoding includes applying.
    std::int64_t predict_ns = 0, encode_ns = 0, hash_ns = 0;
  };
  /// Predicts the next frame, encodes towards `target` and applies. Tells `observer`, if there is one.
  /// `target_numbers`: of the target's blocks, always of the same owner; without them silent blocks cost
  /// more. `news`: sections of the frame's news that fit the layout's features and the world; they are told
  /// in front of what `budget` counts, and so are `data`, for a stream that has them (empty: as they were).
  /// Allocates nothing after the first few frames, but for news, and for more lifecycle records than ever
  /// before.
  FrameResult advance(const State& target, std::span<const LifecycleRecord> lifecycle,
                      std::size_t budget = kNoBudget, EncodeObserver* observer = nullptr,
                      BlockNumbers target_numbers = {}, std::span<const std::byte> news = {},
                      const DataTarget& data = {});
  /// For measurement only: a monotonic clock in nanoseconds, as the core has none of its own.
  void set_clock(std::int64_t (*now_ns)());
  /// Sets the parameters from the next advance() on; they travel in that delta.
  void set_parameters(const StreamParameters& parameters);

  /// Makes the next advance() round every body, on both sides, so that a snapshot cut right after it is
  /// smaller. No body gets further from `target` than without rounding; see idl/PROTOCOL.md, "Rounding".
  void round_next();

  [[nodiscard]] Frame frame() const;
  [[nodiscard]] const State& state() const;
  [[nodiscard]] const Drive& drive() const;                  ///< in force at frame()
  [[nodiscard]] const StreamParameters& parameters() const;  ///< in force at frame()
  [[nodiscard]] std::uint64_t hash() const;                  ///< hash of state()
  [[nodiscard]] std::uint64_t last_input() const;
  [[nodiscard]] const BodyData* data() const;  ///< at frame(); null: the stream has none
  /// What the predicted step tells of its last call: Predictor::pushes(), after watch_pushes().
  [[nodiscard]] const Predictor& predictor() const;
  void watch_pushes();
  [[nodiscard]] std::size_t payload_bound() const;
  /// Writes a snapshot cut right after delta frame(): see idl/PROTOCOL.md, "Snapshot". Replaces the content
  /// of `out`. `as`: the id of another stream that has the same deltas; by default its own.
  void snapshot(std::vector<std::byte>& out, std::optional<StreamId> as = {});
  [[nodiscard]] std::size_t snapshot_bound() const;

 private:
  struct Impl;
  explicit ServerTimeline(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// A client's side: holds the states of all frames from the last delta to now. Not thread-safe.
class ClientTimeline {
 public:
  /// Errors: kUnsupported, kMalformed, kInvalidArgument (capacity, parameters, lead).
  static Result<ClientTimeline> create(const Layout& layout, const LocalOptions& local = {});
  /// Uses the caller's predictor; the one that `layout` names is ignored.
  static Result<ClientTimeline> create(const Layout& layout, std::unique_ptr<Predictor> predictor,
                                       const LocalOptions& local = {});
  ClientTimeline(ClientTimeline&&) noexcept;
  ClientTimeline& operator=(ClientTimeline&&) noexcept;
  ClientTimeline(const ClientTimeline&) = delete;
  ClientTimeline& operator=(const ClientTimeline&) = delete;
  ~ClientTimeline();

  /// Starts anew from a snapshot. Errors: kMalformed, kOutOfOrder (another epoch or stream), kMismatch (its
  /// own hash). After an error `playing()` is false, and of all states only that of applied() remains.
  [[nodiscard]] Result<void> load(std::span<const std::byte> snapshot, Epoch epoch, StreamId stream = {});
  [[nodiscard]] bool playing() const;

  /// Takes scheduled inputs in any order, after load(). Duplicates and numbers that the snapshot already
  /// counts are ignored. If the input acts on a frame that was simulated but not applied, that frame and all
  /// after it are simulated again. Errors: kCapacity; kMalformed; kOutOfOrder before load() and for a frame
  /// that was already applied (the server broke its promise).
  [[nodiscard]] Result<void> schedule(const ScheduledDrive& input);
  /// Every input number up to this one is held, counted from the snapshot's.
  [[nodiscard]] std::uint64_t inputs_held() const;

  /// Applies delta `frame` == applied() + 1. Simulates up to it first if necessary, checks the hash, and
  /// re-simulates the frames beyond it. Needs inputs_held() >= last_input. Errors: kOutOfOrder, kMalformed,
  /// kUnsupported: the state does not change. kMismatch: applied but wrong; load() again.
  [[nodiscard]] Result<void> apply(Frame frame, std::uint64_t last_input, std::uint64_t hash,
                                   std::span<const std::byte> payload);
  /// Takes delta `frame` == applied() + 1 for applied, unread, for a caller that only passes deltas on:
  /// hash() is then the server's word. From then on there is no state, until load(). Needs inputs_held() >=
  /// last_input. Errors: kOutOfOrder.
  [[nodiscard]] Result<void> pass(Frame frame, std::uint64_t last_input, std::uint64_t hash);
  /// False: deltas were passed since the last load(). Then state() and what else tells of it are of an
  /// earlier frame, apply() is refused and nothing is simulated.
  [[nodiscard]] bool holds_state() const;
  /// Writes a snapshot of the agreed state at applied(), as the server would cut it there, for a caller that
  /// serves further clients. Only while playing() and holds_state(). Replaces the content of `out`.
  void snapshot(std::vector<std::byte>& out) const;
  /// Sets the epoch and stream that snapshot() writes until the next load(), for a caller that serves them as
  /// its own session.
  void rename(Epoch epoch, StreamId stream);
  /// Simulates one frame ahead if now() < applied() + lead (clamped to max_lead). Returns whether it did.
  bool step(std::uint32_t lead);
  /// Simulates the frame after applied(), unless that is done, while its state is still in the caches. now()
  /// does not change. The next apply() or step() then uses the result.
  void prepare();

  [[nodiscard]] Frame applied() const;  ///< last frame whose delta was applied
  [[nodiscard]] Frame now() const;      ///< last frame stepped to, applied() .. applied() + max_lead
  /// The state of a frame from applied() to now(); valid until the next call that is not const.
  [[nodiscard]] const State& state(Frame frame) const;
  [[nodiscard]] std::uint64_t hash() const;                          ///< hash of state(applied()), as last
                                                                     ///< checked
  [[nodiscard]] const Drive& drive() const;                          ///< in force at applied()
  [[nodiscard]] std::span<const Slot> touched() const;               ///< slots that the last apply() touched
  [[nodiscard]] std::span<const Slot> corrected() const;             ///< slots that the last apply()
                                                                     ///< corrected
  [[nodiscard]] std::span<const LifecycleRecord> lifecycle() const;  ///< records of the last apply()
  [[nodiscard]] const StreamParameters& parameters() const;          ///< in force at applied()
  [[nodiscard]] const SessionWorld* world() const;  ///< at applied(); null: the session has no features
  [[nodiscard]] const BodyData* data() const;       ///< at applied(); null: the stream has none
  /// Of the last apply(); it points into that delta's payload. Empty after load() and pass().
  [[nodiscard]] const News& news() const;

  /// Durations of the last apply(): simulating up to the frame, if step() had not done so, and again beyond
  /// it; decoding and correcting; checking its hash. Zero without a clock.
  struct Timings {
    std::int64_t predict_ns = 0, decode_ns = 0, hash_ns = 0;
  };
  [[nodiscard]] Timings timings() const;
  /// For measurement only, as ServerTimeline::set_clock().
  void set_clock(std::int64_t (*now_ns)());

 private:
  struct Impl;
  explicit ClientTimeline(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem
