#pragma once
// What clients may do to the simulation, and when it happens.

#include <cstdint>
#include <vector>

#include "sdk/transport/messages.hpp"
#include "services/host/outbox.hpp"
#include "services/host/roster.hpp"
#include "services/host/simulation.hpp"
#include "services/host/stream.hpp"
#include "tandem/result.hpp"

namespace tandem::host {

inline constexpr std::size_t kMostImmediate = 1024;  ///< waiting for one step, all clients together
/// Scheduled inputs per frame, all clients together; those of lead + 1 frames fit kMaxPendingInputs.
inline constexpr std::uint32_t kMostScheduledPerFrame = 100;

/// Validates inputs, gives them their frame and hands them to the simulation in time. Not thread-safe.
class InputDesk {
 public:
  InputDesk(Epoch epoch, engine::Simulation& simulation, Stream& stream, Outbox& outbox)
      : epoch_(epoch), simulation_(&simulation), stream_(&stream), outbox_(&outbox) {}

  /// Decides one input of a known client; the outcome stands in its account and is what this returns.
  transport::Reason handle(Account& account, const transport::InputMessage& input, std::int64_t now_ns);
  /// An input of the server's own. Returns the frame it acts on.
  Result<Frame> inject(const engine::Input& input);

  /// Hands the simulation all that acts on frame s, the one about to be stepped.
  void apply(Frame s);
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

 private:
  struct Waiting {
    Frame frame = 0;
    engine::Input input;
  };
  struct Source {
    transport::ClientId client = 0;
    std::uint64_t number = 0;
  };

  transport::Reason decide(Account& account, const transport::InputMessage& input, std::int64_t now_ns,
                           Frame& acts_on);
  transport::Reason accept(const engine::Input& input, const Source& source, Frame& acts_on);
  transport::Reason schedule(const engine::Input& input, const engine::Classification& effect,
                             const Source& source, Frame& acts_on);
  [[nodiscard]] Frame next_frame() const { return stream_->frame() + 1; }

  Epoch epoch_;
  engine::Simulation* simulation_;
  Stream* stream_;
  Outbox* outbox_;
  std::vector<Waiting> scheduled_;        // in the order of their numbers, so ascending by frame
  std::vector<engine::Input> immediate_;  // in the order of arrival
  Frame scheduling_frame_ = 0;
  std::uint32_t scheduled_now_ = 0;  // for scheduling_frame_
  std::uint64_t refused_ = 0;
};

}  // namespace tandem::host
