#pragma once
// The interface of what makes a host's frames: a running simulation (live_source.hpp), or a recording of one.

#include <bitset>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/core/layout/parameters.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/messages.hpp"
#include "services/host/accounts/input_verdict.hpp"
#include "services/host/checkpoint/checkpoint.hpp"
#include "services/host/news/news_desk.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/outgoing/publication.hpp"
#include "services/host/streams/frame_budget.hpp"
#include "services/host/streams/position_error.hpp"
#include "services/program/budget.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

using accounts::InputVerdict;

/// When an input came, and what it may cost.
struct InputTerms {
  std::int64_t now_ns = 0;
  accounts::Budget* budget = nullptr;  ///< of the client's DDS participant; null: no limit
};

/// Counts of a stream's bodies, for figures.
struct BodyCounts {
  std::uint32_t alive = 0, at_rest = 0;
  std::uint32_t crowded = 0;  ///< see Predictor; 0 where the source does not predict
};

/// A subset of a session's streams, by their ids.
using StreamSet = std::bitset<transport::kMaxStreams>;

/// Makes frames in order and takes the inputs that act on them. A host calls it from one thread.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// The session as it is announced. The ids of its streams are 0, 1, ... and their generations are 0.
  [[nodiscard]] virtual const transport::SessionMessage& session() const = 0;
  /// What clients are told: session() without the streams that are still on trial.
  [[nodiscard]] virtual transport::SessionMessage announced() const { return session(); }
  /// False for a stream that is still on trial: announced() does not list it.
  [[nodiscard]] virtual bool offers(std::uint32_t /*stream*/) const { return true; }
  [[nodiscard]] virtual Frame frame() const = 0;  ///< frame of the last deltas

  /// The streams that are made now; the others cost nothing.
  [[nodiscard]] virtual StreamSet active() const = 0;
  /// Makes these streams from the next frame on, if the source can choose. A stream that was not made before
  /// begins anew at frame().
  virtual void set_active(StreamSet streams) = 0;
  /// The client state of a stream that is made now.
  [[nodiscard]] virtual const State& agreed(std::uint32_t stream) const = 0;
  [[nodiscard]] virtual std::uint64_t hash(std::uint32_t stream) const = 0;  ///< hash of agreed()
  /// The parameters of the next frame. For a stream that is not made now: the parameters with which it
  /// begins.
  [[nodiscard]] virtual const StreamParameters& parameters(std::uint32_t stream) const = 0;

  /// Of a stream that is made now.
  [[nodiscard]] virtual BodyCounts bodies(std::uint32_t stream) const {
    return {agreed(stream).alive_count(), agreed(stream).rest_count()};
  }

  /// Bodies of the simulation that clients do not see.
  [[nodiscard]] virtual std::uint32_t hidden() const { return 0; }

  /// How far agreed() is from the bodies that it stands for, in scene units; 0 where that is not known.
  [[nodiscard]] virtual PositionError error_of(std::uint32_t /*stream*/) const { return {}; }

  /// Begins the next frame, where that takes a while. Without it, next() does both. Between take_step() and
  /// next(), it begins the frame after the one that next() makes.
  virtual void begin_next() {}
  /// True if next() need not wait for what begin_next() began.
  [[nodiscard]] virtual bool next_ready() { return true; }
  /// A file descriptor that becomes readable when next_ready() may have changed; -1: none.
  [[nodiscard]] virtual int next_descriptor() const { return -1; }
  /// Takes over what begin_next() began, so that next() does not need the simulation any more. Returns false
  /// if there are no more frames: see error(). Without it, next() does both.
  virtual bool take_step() { return true; }
  /// True if a step is under way: begin_next() began it, and it was not taken over.
  [[nodiscard]] virtual bool stepping() const { return false; }
  /// True between take_step() and next(), if begin_next() may be called now.
  [[nodiscard]] virtual bool may_begin_early() const { return false; }
  /// No step begins early before the frame of the one under way is made.
  virtual void rest_after_frame() {}
  /// True if refresh_names() has to ask a simulation that is making no step.
  [[nodiscard]] virtual bool needs_rest() const { return false; }
  /// True if the frames ended between two of them: see error().
  [[nodiscard]] virtual bool failed() { return false; }

  /// True for frames that come from another server at times of its own. Whoever polls the host does so when
  /// one came, and clients are not waited for: nothing here can hold that server up.
  [[nodiscard]] virtual bool is_fed() const { return false; }
  /// Those of `streams` of which a snapshot of frame() can be cut now. Where a stream has to be fetched
  /// first, a call begins that.
  virtual StreamSet prepare(StreamSet streams) { return streams; }

  /// What the next frame may take, by stream; of streams with a cap. Without it, any.
  virtual void set_budgets(std::span<const FrameBudget> /*budgets*/) {}
  /// Makes the next frame; empty if there is none any more. `snapshots_follow`: the streams of which a
  /// snapshot is cut right after it. Queues the messages that have to leave before the deltas.
  virtual std::optional<MadeFrame> next(StreamSet snapshots_follow, Outbox& outbox) = 0;
  /// Writes a snapshot of agreed(stream) for joiners. Replaces the content of `out`.
  virtual void snapshot(std::uint32_t stream, std::vector<std::byte>& out) = 0;

  /// Decides a well-formed input of a client that may send it; of the server itself, if its client is 0. The
  /// verdict has no claim.
  virtual InputVerdict accept(const transport::InputMessage& input, const InputTerms& terms,
                              Outbox& outbox) = 0;
  /// Appends what became of inputs that accept() left for later (kLater), with their claims.
  virtual void take_outcomes(std::vector<InputVerdict>& /*out*/) {}
  /// Brings the names of bodies in session() up to date. Returns true if they, or the streams of announced(),
  /// changed since the last call.
  virtual bool refresh_names() { return false; }
  /// Called once after each frame, when its messages are queued.
  virtual void use_spare_time() {}
  /// What a stream that is not made would take at the nominal frame rate, as it was measured last; 0 where
  /// that is not known.
  [[nodiscard]] virtual double estimated_mbit_per_s(std::uint32_t /*stream*/) const { return 0; }

  /// Where the application leaves keys and events; null where the session has none of its own.
  [[nodiscard]] virtual NewsDesk* news() { return nullptr; }

  // The following functions are for a running simulation; other sources do not implement them.

  /// The name of a stream, for logs and figures; empty if it has none.
  [[nodiscard]] virtual std::string name(std::uint32_t stream) const { return std::to_string(stream); }
  /// Sets parameters from the next frame on, as Stream::set_parameters(). Errors: those of that function;
  /// kOutOfOrder for a stream that is not made now; kUnsupported.
  virtual Result<void> set_parameters(std::uint32_t /*stream*/, const StreamParameters& /*parameters*/) {
    return unsupported();
  }
  /// Copies all that a checkpoint holds of the frames, right after one was made; the clients are the host's.
  /// Keeps the memory that `out` has.
  virtual void capture(checkpoint::Checkpoint& /*out*/) const {}
  /// The hash of the simulation's bodies on the lattice at frame(), by which a server that stands by knows
  /// that it makes the same; 0 where there is no simulation.
  [[nodiscard]] virtual std::uint64_t bodies_hash() { return 0; }
  /// Lines for a log since the last call.
  [[nodiscard]] virtual std::vector<std::string> take_notices(std::int64_t /*now_ns*/) { return {}; }
  /// The same, of what needs somebody's attention.
  [[nodiscard]] virtual std::vector<std::string> take_warnings(std::int64_t /*now_ns*/) { return {}; }
  /// The error that ended the frames; empty if they did not end by an error.
  [[nodiscard]] virtual std::optional<Error> error() const { return std::nullopt; }

 private:
  [[nodiscard]] static tl::unexpected<Error> unsupported() {
    return fail(ErrorCode::kUnsupported, "nothing is simulated here");
  }
};

}  // namespace tandem::host
