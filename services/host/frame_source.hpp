#pragma once
// Where a host's frames come from: a simulation that runs (live_source.hpp), or a recording of one.

#include <bitset>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/core/layout/parameters.hpp"
#include "sdk/transport/limits.hpp"
#include "sdk/transport/messages.hpp"
#include "services/host/outbox.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

/// Which client's input it is; 0, 0 for the server's own.
struct InputOrigin {
  transport::ClientId client = 0;
  std::uint64_t number = 0;
};

/// Some of a session's streams, by their ids.
using StreamSet = std::bitset<transport::kMaxStreams>;

/// Frames in order, and what may act on them. A host calls it from one thread.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// As it is announced; the ids of its streams are 0, 1, ... and their generation 0.
  [[nodiscard]] virtual const transport::SessionMessage& session() const = 0;
  [[nodiscard]] virtual Frame frame() const = 0;  ///< of the last deltas

  /// The streams that are made; the others cost nothing.
  [[nodiscard]] virtual StreamSet active() const = 0;
  /// From the next frame on these are made, where the source can choose. One that was not is begun anew at
  /// frame().
  virtual void set_active(StreamSet streams) = 0;
  /// Of a stream that is made.
  [[nodiscard]] virtual const State& agreed(std::uint32_t stream) const = 0;
  [[nodiscard]] virtual std::uint64_t hash(std::uint32_t stream) const = 0;  ///< of agreed()
  /// Of the next frame; of a stream that is not made: with which it begins.
  [[nodiscard]] virtual const StreamParameters& parameters(std::uint32_t stream) const = 0;

  struct MadeDelta {
    std::uint32_t stream = 0;
    std::uint64_t hash = 0;
    std::span<const std::byte> payload = {};
    std::uint32_t corrected = 0;
  };
  struct Made {
    Frame frame = 0;
    std::uint64_t last_input = 0;
    std::span<const MadeDelta> deltas;  ///< of each active stream, ascending; until the next call
    std::int64_t step_ns = 0;           ///< of the engine; 0 without a clock
  };
  /// The next frame; nothing when there is none any more. `snapshots_follow`: of these streams one is cut
  /// right after it. Queues what has to leave before the deltas.
  virtual std::optional<Made> next(StreamSet snapshots_follow, Outbox& outbox) = 0;
  /// Of agreed(stream), for joiners. Replaces the content of `out`.
  virtual void snapshot(std::uint32_t stream, std::vector<std::byte>& out) = 0;

  /// Decides a well-formed input of a client that may send it. kNone: it acts on frame `acts_on`.
  virtual transport::Reason accept(const engine::Input& input, const InputOrigin& origin, Outbox& outbox,
                                   Frame& acts_on) = 0;
};

}  // namespace tandem::host
