#pragma once
// The host drives a full simulation, or another source of frames, publishes its streams, and answers its
// clients. It implements all rules of behaviour over time (idl/STATES.md). It owns no thread, reads no clock
// and writes to no socket.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/wire/port.hpp"
#include "services/host/frames/configuration.hpp"
#include "services/host/frames/frame_source.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/outgoing/report.hpp"
#include "services/host/succession/standbys.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

/// Drives one session. Call poll() from one thread, when something arrived and at the latest at
/// next_wake_ns(). Drain outbox() in another thread (Publisher) or with drain(). The configuration bounds the
/// memory.
class Host {
 public:
  enum class State : std::uint8_t {
    kClaiming,  ///< looks for another server of the same session; nothing was announced
    kWaiting,   ///< announced; joiners are served; frame 1 waits for participants
    kRunning,
    kRefused,     ///< another server owns the session: see error()
    kHandedOver,  ///< a server that stood by continues the session
    kEnded,       ///< the source has no more frames: see error()
  };

  /// Creates a host. `simulation` and `port` must outlive it. `simulation` must not have been stepped; its
  /// bodies are the start frame. Errors: kInvalidArgument (the configuration; an announcement that clients
  /// would not accept; body columns not `capacity` long), kUnsupported (codec, predictor), kMalformed
  /// (tables).
  static Result<std::unique_ptr<Host>> create(HostConfig config, engine::Simulation& simulation,
                                              transport::ServerPort& port);
  /// Creates a host for frames that do not come from a simulation. `source` announces `config`'s session,
  /// epoch and frame rate. Errors: kInvalidArgument.
  static Result<std::unique_ptr<Host>> create(ServiceConfig config, std::unique_ptr<FrameSource> source,
                                              transport::ServerPort& port);
  ~Host();
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  /// Takes what arrived, then begins or finishes at most one frame and queues what must be published. A frame
  /// whose step takes a while is begun by one poll and finished by a later one. `now_ns` is a
  /// steady clock that never goes back, `wall_ns` the time of day; the first one is the begin of the stamps
  /// that clients see, from which the steady clock counts. Returns true if a frame was produced: see
  /// report().
  bool poll(std::int64_t now_ns, std::int64_t wall_ns);
  /// Steady time at which poll() has something to do even if nothing arrives. At most 50 ms ahead.
  [[nodiscard]] std::int64_t next_wake_ns() const;
  /// True if a frame was begun and is not finished: capture() has to wait.
  [[nodiscard]] bool frame_under_way() const;
  /// With HostConfig::pipeline a frame may be under way after every poll. This leaves a moment without one:
  /// after the poll that makes the frame under way.
  void rest_after_frame();
  /// No frame follows soon: tells clients of the frames that a later delta would have told.
  void tell_collected_frames();
  /// Readable when the frame under way can be finished; -1: there is none, or next_wake_ns() says when.
  [[nodiscard]] int descriptor() const;

  [[nodiscard]] State state() const;
  /// Set in kRefused: kConflict, naming the other server. Set in kEnded if a simulation ran:
  /// kInvalidArgument, its body columns are no longer `capacity` long; kIo, its failure().
  [[nodiscard]] const std::optional<Error>& error() const;
  [[nodiscard]] const FrameReport& report() const;
  [[nodiscard]] Outbox& outbox();

  /// Applies an input of the server as if a participant had sent it now. Returns the frame that it acts on.
  /// Errors: kInvalidArgument (refused by the simulation), kCapacity, kUnsupported (no simulation).
  Result<Frame> inject(const engine::Input& input);

  /// Where keys and events of the session are left; null if its layout has no such feature. The host must
  /// outlive its use.
  [[nodiscard]] NewsDesk* news();

  /// Copies all that a server needs to go on from frame(), for a checkpoint: HostConfig::goes_on_from. Call
  /// it while no frame is under way. Keeps the memory that `out` has. Only for a simulation.
  void capture(checkpoint::Checkpoint& out) const;

  /// True if servers stand by: checkpoints are needed, and offered with offer_checkpoint(). Only for a
  /// simulation.
  [[nodiscard]] bool wants_checkpoints() const;
  /// True if a checkpoint of the next frame is needed without waiting for the interval.
  [[nodiscard]] bool wants_checkpoint_now() const;
  /// Sends a checkpoint of this epoch to the servers that stand by.
  void offer_checkpoint(const std::shared_ptr<const checkpoint::Encoded>& checkpoint);
  [[nodiscard]] const Standbys& standbys() const;

  /// Sets what decoder and predicted step read (threshold, quantisation steps, gains, decay): see
  /// Stream::set_parameters(). Errors: also kUnsupported without a simulation and kOutOfOrder while the
  /// stream is not made.
  [[nodiscard]] Result<void> set_parameters(const StreamParameters& parameters, std::uint32_t stream = 0);
  /// The parameters of a stream's next frame.
  [[nodiscard]] const StreamParameters& parameters(std::uint32_t stream = 0) const;
  [[nodiscard]] double threshold_m(std::uint32_t stream = 0) const;  ///< of the next frame, scene units

  /// Changes what ServiceConfig says of these, while clients play: see Roster::set_limits(). Errors:
  /// kInvalidArgument for a limit of 0.
  [[nodiscard]] Result<void> set_limits(std::uint32_t client_limit,
                                        std::optional<std::int64_t> stall_timeout_ns);

  [[nodiscard]] const transport::SessionMessage& session() const;
  [[nodiscard]] Frame frame() const;  ///< frame of the last delta
  /// The first stream that is made now; there is always one.
  [[nodiscard]] std::uint32_t first_made() const;
  [[nodiscard]] const tandem::State& agreed() const;  ///< client state at frame(), of first_made()
  [[nodiscard]] std::uint64_t hash() const;           ///< of agreed()
  [[nodiscard]] std::uint32_t window() const;         ///< window in force
  [[nodiscard]] std::uint32_t participants() const;   ///< playing and waited for
  [[nodiscard]] std::uint32_t observers() const;      ///< playing and not waited for
  [[nodiscard]] HostTotals totals() const;
  /// For a monitor, about once a second: O(bodies), 1.5 us for each 1,000.
  [[nodiscard]] HostMoment present() const;
  /// Lines for a log (joined, demoted, refused ...), oldest first; forgets them. At most 2 a second on
  /// average, and one in 10 s about one client.
  [[nodiscard]] std::vector<std::string> take_notices();
  /// The same, of what needs somebody's attention.
  [[nodiscard]] std::vector<std::string> take_warnings();

 private:
  struct Impl;
  explicit Host(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::host
