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
#include "services/host/frames/configuration.hpp"
#include "services/host/frames/frame_source.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/outgoing/report.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

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
