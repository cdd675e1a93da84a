#pragma once
// Where a host's frames come from: a simulation that runs (live_source.hpp), or a recording of one.

#include <bitset>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sdk/core/layout/parameters.hpp"
#include "sdk/transport/limits.hpp"
#include "sdk/transport/messages.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/outgoing/publication.hpp"
#include "tandem/result.hpp"
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

  /// The next frame; nothing when there is none any more. `snapshots_follow`: of these streams one is cut
  /// right after it. Queues what has to leave before the deltas.
  virtual std::optional<MadeFrame> next(StreamSet snapshots_follow, Outbox& outbox) = 0;
  /// Of agreed(stream), for joiners. Replaces the content of `out`.
  virtual void snapshot(std::uint32_t stream, std::vector<std::byte>& out) = 0;

  /// Decides a well-formed input of a client that may send it. kNone: it acts on frame `acts_on`.
  virtual transport::Reason accept(const engine::Input& input, const InputOrigin& origin, Outbox& outbox,
                                   Frame& acts_on) = 0;

  // What follows is of a simulation that runs; other sources have none of it.

  /// Of a stream, for logs and figures; empty: it has none.
  [[nodiscard]] virtual std::string name(std::uint32_t stream) const { return std::to_string(stream); }
  /// Decides an input of the server's own. Returns the frame it acts on. Errors: kInvalidArgument (the
  /// simulation refuses it), kCapacity, kUnsupported.
  virtual Result<Frame> inject(const engine::Input& /*input*/, Outbox& /*outbox*/) { return unsupported(); }
  /// In force from the next frame on: Stream::set_parameters(). Errors: as that; kOutOfOrder for a stream
  /// that is not made; kUnsupported.
  virtual Result<void> set_parameters(std::uint32_t /*stream*/, const StreamParameters& /*parameters*/) {
    return unsupported();
  }
  /// What is worth a line in a log since the last call.
  [[nodiscard]] virtual std::vector<std::string> take_notices(std::int64_t /*now_ns*/) { return {}; }
  /// Why there is no next frame, where that is an error.
  [[nodiscard]] virtual std::optional<Error> error() const { return std::nullopt; }

 private:
  [[nodiscard]] static tl::unexpected<Error> unsupported() {
    return fail(ErrorCode::kUnsupported, "nothing is simulated here");
  }
};

}  // namespace tandem::host
