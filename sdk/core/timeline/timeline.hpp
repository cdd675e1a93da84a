#pragma once
// Frames in order, on both sides: predicted steps, deltas, scheduled inputs, snapshots.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/core/layout/layout.hpp"
#include "sdk/core/predict/predictor.hpp"

namespace tandem {

/// What one side decides for itself, beside the layout: the other never learns of it, and no byte changes.
struct LocalOptions {
  RunBlocks run_blocks;  ///< how this side codes blocks side by side; see Codec
};

/// An input that changes the predicted step. `number` counts 1, 2, ... within an epoch.
struct ScheduledDrive {
  std::uint64_t number = 0;
  Frame frame = 0;  ///< acts in the step that produces this frame
  Drive drive;
  friend bool operator==(const ScheduledDrive&, const ScheduledDrive&) = default;
};

/// Scheduled inputs still to act at most; more is refused (kCapacity).
inline constexpr std::size_t kMaxPendingInputs = 256;

/// The server's side: predicts, encodes and applies, one frame at a time. Not thread-safe.
class ServerTimeline {
 public:
  /// Errors: kUnsupported, kMalformed, kInvalidArgument (capacity, parameters, lead).
  static Result<ServerTimeline> create(const Layout& layout, Epoch epoch, const LocalOptions& local = {},
                                       StreamId stream = {});
  /// With a predictor of the caller's own; the one that `layout` names is not looked at.
  static Result<ServerTimeline> create(const Layout& layout, Epoch epoch,
                                       std::unique_ptr<Predictor> predictor, const LocalOptions& local = {},
                                       StreamId stream = {});
  ServerTimeline(ServerTimeline&&) noexcept;
  ServerTimeline& operator=(ServerTimeline&&) noexcept;
  ServerTimeline(const ServerTimeline&) = delete;
  ServerTimeline& operator=(const ServerTimeline&) = delete;
  ~ServerTimeline();

  /// The agreed state at `frame` (frame 0: the start block), before the first advance(). Of a session that
  /// went on before: `last_input`, the last number issued, and those up to it that are still to act.
  void start(Frame frame, const State& state, const Drive& drive, std::uint64_t last_input = 0,
             std::span<const ScheduledDrive> pending = {});
  /// Numbers must follow one another and frames must lie in the future. The last number issued for a frame
  /// wins. Errors: kOutOfOrder, kCapacity, kInvalidArgument (gravity out of range).
  [[nodiscard]] Result<void> schedule(const ScheduledDrive& input);

  struct FrameResult {
    Frame frame = 0;
    std::uint64_t last_input = 0;        ///< highest number scheduled before this delta
    std::uint64_t hash = 0;              ///< of the agreed state
    std::span<const std::byte> payload;  ///< valid until the next advance()
    std::size_t correction_bytes = 0;
    std::uint32_t corrected = 0;
    /// Encoding applies as it goes. Filled only when a clock was given: set_clock().
    std::int64_t predict_ns = 0, encode_ns = 0, hash_ns = 0;
  };
  /// Predicts the next frame, encodes towards `target` and applies; tells `observer`, if any. Allocates
  /// nothing after the first few frames.
  FrameResult advance(const State& target, std::span<const LifecycleRecord> lifecycle,
                      std::size_t budget = kNoBudget, EncodeObserver* observer = nullptr);
  /// For measurement only: a monotonic clock in nanoseconds, as the core has none of its own.
  void set_clock(std::int64_t (*now_ns)());
  /// In force from the next advance() on; travels in that delta.
  void set_parameters(const StreamParameters& parameters);

  /// The next advance() rounds every body, on both sides, so that a snapshot cut right after it is smaller.
  /// No body gets further from `target` than without; see idl/PROTOCOL.md, "Rounding".
  void round_next();

  [[nodiscard]] Frame frame() const;
  [[nodiscard]] const State& state() const;
  [[nodiscard]] const Drive& drive() const;                  ///< in force at frame()
  [[nodiscard]] const StreamParameters& parameters() const;  ///< in force at frame()
  [[nodiscard]] std::uint64_t hash() const;                  ///< of state()
  [[nodiscard]] std::uint64_t last_input() const;
  [[nodiscard]] std::size_t payload_bound() const;
  /// One cut right after delta frame(): see idl/PROTOCOL.md, "Snapshot". Replaces the content of `out`.
  void snapshot(std::vector<std::byte>& out);
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
  /// With a predictor of the caller's own; the one that `layout` names is not looked at.
  static Result<ClientTimeline> create(const Layout& layout, std::unique_ptr<Predictor> predictor,
                                       const LocalOptions& local = {});
  ClientTimeline(ClientTimeline&&) noexcept;
  ClientTimeline& operator=(ClientTimeline&&) noexcept;
  ClientTimeline(const ClientTimeline&) = delete;
  ClientTimeline& operator=(const ClientTimeline&) = delete;
  ~ClientTimeline();

  /// Starts over from a snapshot. Errors: kMalformed, kOutOfOrder (another epoch or stream), kMismatch (its
  /// own hash); on error `playing()` is false, and of all states that of applied() is still there.
  [[nodiscard]] Result<void> load(std::span<const std::byte> snapshot, Epoch epoch, StreamId stream = {});
  [[nodiscard]] bool playing() const;

  /// Scheduled inputs in any order, after load(); duplicates and numbers the snapshot already counts are
  /// ignored. A frame that was simulated but not applied is simulated again, and all after it. Errors:
  /// kCapacity; kMalformed; kOutOfOrder before load() and for a frame that was already applied (a gap in the
  /// server's promise).
  [[nodiscard]] Result<void> schedule(const ScheduledDrive& input);
  /// Every input number up to here is held, counted from the snapshot's.
  [[nodiscard]] std::uint64_t inputs_held() const;

  /// Applies delta `frame` == applied() + 1, simulating up to it first if need be, checks the hash and
  /// re-simulates what was simulated beyond it. Needs inputs_held() >= last_input. Errors: kOutOfOrder,
  /// kMalformed, kUnsupported: state untouched. kMismatch: applied but wrong; load() again.
  [[nodiscard]] Result<void> apply(Frame frame, std::uint64_t last_input, std::uint64_t hash,
                                   std::span<const std::byte> payload);
  /// The agreed state at applied(), as the server would cut it there: for who serves further clients. While
  /// playing() only. Replaces the content of `out`.
  void snapshot(std::vector<std::byte>& out) const;
  /// What snapshot() says from now on until load(), for who serves them as a session of his own.
  void rename(Epoch epoch, StreamId stream);
  /// Simulates one frame ahead if now() < applied() + lead (clamped to max_lead); returns whether it did.
  bool step(std::uint32_t lead);
  /// Simulates the frame after applied() unless that is done, while its state is still in the caches; now()
  /// stays. The next apply() or step() finds it ready.
  void prepare();

  [[nodiscard]] Frame applied() const;  ///< last frame whose delta is in
  [[nodiscard]] Frame now() const;      ///< last frame stepped to, applied() .. applied() + max_lead
  /// State of a frame from applied() to now(); valid until the next call that is not const.
  [[nodiscard]] const State& state(Frame frame) const;
  [[nodiscard]] std::uint64_t hash() const;                          ///< of state(applied()), as last checked
  [[nodiscard]] const Drive& drive() const;                          ///< in force at applied()
  [[nodiscard]] std::span<const Slot> touched() const;               ///< by the last apply()
  [[nodiscard]] std::span<const Slot> corrected() const;             ///< by the last apply()'s corrections
  [[nodiscard]] std::span<const LifecycleRecord> lifecycle() const;  ///< of the last apply()
  [[nodiscard]] const StreamParameters& parameters() const;          ///< in force at applied()

  /// Of the last apply(): simulating up to the frame, where step() had not, and again beyond it; decoding and
  /// correcting; checking its hash. Zero without a clock.
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
