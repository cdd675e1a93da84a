#pragma once
// A simulation that runs, as a source of frames: inputs, step, stream.

#include <cstdint>
#include <optional>
#include <vector>

#include "services/host/frame_source.hpp"
#include "services/host/host.hpp"
#include "services/host/stream.hpp"
#include "tandem/result.hpp"

namespace tandem::host {

inline constexpr std::size_t kMostImmediate = 1024;  ///< waiting for one step, all clients together
/// Scheduled inputs per frame, all clients together; those of lead + 1 frames fit kMaxPendingInputs.
inline constexpr std::uint32_t kMostScheduledPerFrame = 100;

/// Gives inputs their frame, hands them to the simulation in time, and streams what becomes of its bodies.
/// One stream so far: a second one would be produced from the same step, side by side with the first. Not
/// thread-safe.
class LiveSource final : public FrameSource {
 public:
  /// `simulation` must outlive it.
  LiveSource(const HostConfig& config, engine::Simulation& simulation, Stream stream);

  [[nodiscard]] const transport::SessionMessage& session() const override { return session_; }
  [[nodiscard]] Frame frame() const override { return stream_.frame(); }
  [[nodiscard]] const State& agreed() const override { return stream_.agreed(); }
  [[nodiscard]] std::uint64_t hash() const override { return stream_.hash(); }
  [[nodiscard]] const StreamParameters& parameters() const override { return stream_.parameters(); }
  std::optional<Made> next(bool snapshot_follows, Outbox& outbox) override;
  void snapshot(std::vector<std::byte>& out) override { stream_.snapshot(out); }
  transport::Reason accept(const engine::Input& input, const InputOrigin& origin, Outbox& outbox,
                           Frame& acts_on) override;

  /// An input of the server's own. Returns the frame it acts on. Errors: as Host::inject().
  Result<Frame> inject(const engine::Input& input, Outbox& outbox);
  /// Why there is no next frame; set once next() gave none.
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }
  [[nodiscard]] const engine::Simulation& simulation() const { return *simulation_; }
  [[nodiscard]] Stream& stream() { return stream_; }

 private:
  struct Waiting {
    Frame frame = 0;
    engine::Input input;
  };
  transport::Reason schedule(const engine::Input& input, const engine::Classification& effect,
                             const InputOrigin& origin, Outbox& outbox, Frame& acts_on);
  /// Hands the simulation all that acts on frame s, the one about to be stepped.
  void apply(Frame s);
  [[nodiscard]] Frame next_frame() const { return stream_.frame() + 1; }
  [[nodiscard]] std::int64_t clock() const { return clock_ns_ == nullptr ? 0 : clock_ns_(); }

  engine::Simulation* simulation_;
  Stream stream_;
  transport::SessionMessage session_;
  std::int64_t (*clock_ns_)();
  std::vector<Waiting> scheduled_;        // in the order of their numbers, so ascending by frame
  std::vector<engine::Input> immediate_;  // in the order of arrival
  Frame scheduling_frame_ = 0;
  std::uint32_t scheduled_now_ = 0;  // for scheduling_frame_
  std::optional<Error> error_;
};

}  // namespace tandem::host
