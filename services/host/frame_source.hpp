#pragma once
// Where a host's frames come from: a simulation that runs (live_source.hpp), or a recording of one.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/core/layout/parameters.hpp"
#include "sdk/transport/messages.hpp"
#include "services/host/outbox.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

/// Which client's input it is; 0, 0 for the server's own.
struct InputOrigin {
  transport::ClientId client = 0;
  std::uint64_t number = 0;
};

/// Frames in order, and what may act on them. A host calls it from one thread.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// As it is announced, with one stream, of id and generation 0.
  [[nodiscard]] virtual const transport::SessionMessage& session() const = 0;
  [[nodiscard]] virtual Frame frame() const = 0;  ///< of the last delta
  [[nodiscard]] virtual const State& agreed() const = 0;
  [[nodiscard]] virtual std::uint64_t hash() const = 0;                  ///< of agreed()
  [[nodiscard]] virtual const StreamParameters& parameters() const = 0;  ///< of the next frame

  struct Made {
    Frame frame = 0;
    std::uint64_t last_input = 0, hash = 0;
    std::span<const std::byte> payload;  ///< until the next call
    std::uint32_t corrected = 0;
    std::int64_t step_ns = 0;  ///< of the engine; 0 without a clock
  };
  /// The next frame; nothing when there is none any more. `snapshot_follows`: one is cut right after it.
  /// Queues what has to leave before the delta.
  virtual std::optional<Made> next(bool snapshot_follows, Outbox& outbox) = 0;
  /// Of agreed(), for joiners. Replaces the content of `out`.
  virtual void snapshot(std::vector<std::byte>& out) = 0;

  /// Decides a well-formed input of a client that may send it. kNone: it acts on frame `acts_on`.
  virtual transport::Reason accept(const engine::Input& input, const InputOrigin& origin, Outbox& outbox,
                                   Frame& acts_on) = 0;
};

}  // namespace tandem::host
