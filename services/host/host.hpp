#pragma once
// The host: drives a full simulation, or whatever else frames come from, publishes its streams, and answers
// its clients. All rules of behaviour over time (idl/STATES.md) live behind it; it owns no thread, reads no
// clock and writes to no socket.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/transport/port.hpp"
#include "sdk/transport/units.hpp"
#include "services/host/frame_source.hpp"
#include "services/host/outbox.hpp"
#include "services/host/stream.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

/// What a host decides by itself, whatever its frames come from.
struct ServiceConfig {
  std::string session = "default";
  Epoch epoch = 1;  ///< ms of wall clock at the process's start

  double frame_rate_hz = 30;            ///< nominal; decides the period and what a client is blamed for
  bool free_rate = false;               ///< as fast as window and queue allow (--rate max)
  std::optional<std::uint32_t> window;  ///< frames; empty: automatic from measured round trips
  std::uint32_t window_ceiling = 24;
  std::optional<std::int64_t> stall_timeout_ns = kSecond / 2;  ///< empty: nobody is demoted
  std::uint32_t wait_for = 0;                                  ///< participants that must play before frame 1
  std::uint32_t client_limit = 256;
  std::uint32_t participant_limit = 16;  ///< clients of one DDS participant, or it could take all seats
  std::int64_t claim_ns = kSecond / 2;   ///< how long to look for another server before announcing
  Outbox::Limits outbox;

  /// For measurement only: a monotonic clock in nanoseconds; without one all durations read 0, and deltas are
  /// stamped with the time at which their frame started.
  std::int64_t (*clock_ns)() = nullptr;
};

/// The same with a simulation that runs.
struct HostConfig : ServiceConfig {
  Frame start_frame = 0;
  /// 1 to 8 ways of telling all bodies, of one lattice and one lead, 0 or 1; layout.capacity is the
  /// simulation's. Several have names, each its own. Clients choose (sdk/client/stream_choice.hpp); one that
  /// chooses nothing plays the first.
  std::vector<StreamConfig> streams;

  std::string scene;
  std::string scene_description;
  /// layout.type_count of them: what clients draw.
  std::vector<transport::BodyType> types{{.name = "body", .radius = 0, .colour_rgba = 0xFFFFFFFF}};
};

/// A stream's share of a frame.
struct DeltaReport {
  std::uint32_t stream = 0;
  std::uint64_t hash = 0;
  std::size_t payload_bytes = 0;
  std::uint32_t corrected = 0;
};

/// One frame that was just produced.
struct FrameReport {
  Frame frame = 0;
  std::vector<DeltaReport> deltas;   ///< of each stream that was made, ascending
  double frame_ms = 0, step_ms = 0;  ///< whole frame (step, quantise, predict, encode, apply); engine alone
};

/// Counts of one stream since the start.
struct StreamTotals {
  std::string name;
  bool made = false;  ///< now
  std::uint64_t frames = 0, corrected = 0, payload_bytes = 0;
  std::uint64_t snapshots = 0, snapshot_bytes = 0;
  std::uint32_t participants = 0, observers = 0;  ///< now
};

/// Counts since the start, of all streams together where streams differ.
struct HostTotals {
  std::uint64_t frames = 0, corrected = 0;
  std::uint64_t payload_bytes = 0, snapshot_bytes = 0;  ///< of the deltas and snapshots themselves
  std::uint64_t reply_bytes = 0, input_bytes = 0;       ///< of replies and scheduled inputs as messages
  std::uint64_t stalls = 0;                             ///< suspensions that a participant caused
  std::uint64_t suspended_ms = 0;  ///< waiting past due, for participants or for the queue
  std::uint64_t refused_inputs = 0, refused_messages = 0, snapshots = 0, demotions = 0, clients_seen = 0;
  double frame_ms_p50 = 0, frame_ms_p99 = 0;
  std::vector<StreamTotals> streams;  ///< in the order of their ids
};

/// Drives one session. Call poll() from one thread, whenever something arrived and at the latest at
/// next_wake_ns(). Drain outbox() in another thread (Publisher) or with drain(). Memory is bounded by the
/// configuration.
class Host {
 public:
  enum class State : std::uint8_t {
    kClaiming,  ///< looking for another server of the same session; nothing was announced
    kWaiting,   ///< announced; joiners are served, frame 1 waits for participants
    kRunning,
    kRefused,  ///< another server owns the session: see error()
    kEnded,    ///< the source has no frame any more: see error()
  };

  /// `simulation` and `port` must outlive the host. `simulation` was not stepped yet; its bodies now are the
  /// start frame. Errors: kInvalidArgument (configuration, also what clients would not take of the
  /// announcement; body columns not `capacity` long), kUnsupported
  /// (codec, predictor), kMalformed (tables).
  static Result<std::unique_ptr<Host>> create(HostConfig config, engine::Simulation& simulation,
                                              transport::ServerPort& port);
  /// Of other frames than those of a simulation. What `source` announces is of `config`'s session, epoch and
  /// frame rate. Errors: kInvalidArgument.
  static Result<std::unique_ptr<Host>> create(ServiceConfig config, std::unique_ptr<FrameSource> source,
                                              transport::ServerPort& port);
  ~Host();
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  /// Takes what arrived, then produces at most one frame and queues what must be published. `now_ns` is a
  /// steady clock that never goes back, `wall_ns` the time of day. True when a frame was produced: see
  /// report().
  bool poll(std::int64_t now_ns, std::int64_t wall_ns);
  /// Steady time at which poll() has something to do even if nothing arrives. Never more than 50 ms ahead.
  [[nodiscard]] std::int64_t next_wake_ns() const;

  [[nodiscard]] State state() const;
  /// Set in kRefused: kConflict, naming the other server; and in kEnded, where a simulation ran:
  /// kInvalidArgument, its body columns are not `capacity` long any more.
  [[nodiscard]] const std::optional<Error>& error() const;
  [[nodiscard]] const FrameReport& report() const;
  [[nodiscard]] Outbox& outbox();

  /// Applies an input of the server's own, as if a participant had sent it now. Returns the frame it acts on.
  /// Errors: kInvalidArgument (refused by the simulation), kCapacity, kUnsupported (no simulation).
  Result<Frame> inject(const engine::Input& input);

  /// What decoder and predicted step read (threshold, quantisation steps, gains, decay): see
  /// Stream::set_parameters(); kUnsupported without a simulation.
  /// kOutOfOrder while the stream is not made.
  [[nodiscard]] Result<void> set_parameters(const StreamParameters& parameters, std::uint32_t stream = 0);
  /// Of a stream's next frame.
  [[nodiscard]] const StreamParameters& parameters(std::uint32_t stream = 0) const;
  [[nodiscard]] double threshold_m(std::uint32_t stream = 0) const;  ///< of the next frame, scene units

  [[nodiscard]] const transport::SessionMessage& session() const;
  [[nodiscard]] Frame frame() const;  ///< of the last delta
  /// The first stream that is made: there is always one.
  [[nodiscard]] std::uint32_t first_made() const;
  [[nodiscard]] const tandem::State& agreed() const;  ///< client state at frame(), of first_made()
  [[nodiscard]] std::uint64_t hash() const;           ///< of agreed()
  [[nodiscard]] std::uint32_t window() const;         ///< in force
  [[nodiscard]] std::uint32_t participants() const;   ///< playing and waited for
  [[nodiscard]] std::uint32_t observers() const;      ///< playing and not waited for
  [[nodiscard]] HostTotals totals() const;
  /// One line for a log per thing worth telling (joined, demoted, refused ...), oldest first; forgets them.
  /// At most 2 a second on average, and of one client one in 10 s.
  [[nodiscard]] std::vector<std::string> take_notices();

 private:
  struct Impl;
  explicit Host(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::host
