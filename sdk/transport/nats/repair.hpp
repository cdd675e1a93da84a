#pragma once
// Puts what is published of a session in order, and tells what has to be asked for again.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "sdk/transport/nats/nats_wire.hpp"
#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::transport::nats {

/// When to ask for a run of numbers that is missing: at once, and again when the answer does not go on. Not
/// thread-safe.
class AskTimer {
 public:
  /// Time without progress until the same is asked for again; doubled each time, up to kMaxNs.
  static constexpr std::int64_t kLeastNs = 250 * kMillisecond, kMaxNs = kSecond;
  /// A number of which only a beat tells may be on its way.
  static constexpr std::int64_t kGraceNs = 50 * kMillisecond;

  /// Call it while `count` numbers from `first` on are missing: true if it is time to ask for them. `lost`:
  /// a later one came.
  [[nodiscard]] bool due(std::uint64_t first, std::uint32_t count, bool lost, std::int64_t now_ns);
  /// Nothing is missing.
  void rest() { missing_ns_.reset(); }

 private:
  std::optional<std::int64_t> missing_ns_;  ///< since when something is
  std::uint64_t first_ = 0, end_ = 0;       ///< what was asked for last, less what came
  std::int64_t asked_ns_ = INT64_MIN / 2;   ///< or when the answer last went on
  std::int64_t patience_ns_ = kLeastNs;
};

/// Notes which of an epoch's scheduled inputs came; they are passed on in any order. Bounded. Not
/// thread-safe.
class InputRepair {
 public:
  /// The first delta that came counts inputs up to this number; those before are not missed, as a snapshot
  /// holds them.
  void begin(std::uint64_t number);
  [[nodiscard]] bool begun() const { return begun_; }
  /// False: it came before.
  bool came(std::uint64_t number);
  [[nodiscard]] bool complete_up_to(std::uint64_t number) const { return !begun_ || next_ > number; }
  /// Nothing before `oldest` can be had any more.
  void skip_to(std::uint64_t oldest);
  [[nodiscard]] std::uint64_t next() const { return next_; }
  /// How many are missing from next() on, if `newest` exists.
  [[nodiscard]] std::uint32_t missing(std::uint64_t newest) const;

 private:
  static constexpr std::size_t kMaxNoted = 4096;
  void advance();

  bool begun_ = false;
  std::uint64_t next_ = 1;        // the lowest that did not come
  std::set<std::uint64_t> came_;  // above next_, and lately below
};

/// The deltas of a stream, in parts. Hands them out in order, without a gap, each after the scheduled inputs
/// that it counts. What cannot be had any more is left out, which the client notices. Bounded. Not
/// thread-safe.
class DeltaRepair {
 public:
  static constexpr std::size_t kMaxFrames = 1U << 14U;
  static constexpr std::size_t kMaxHeldBytes = 64U << 20U;

  /// Hands out deltas from this frame on; otherwise the first that comes is the first.
  void begin(Frame first) { next_ = first; }
  /// Takes a part, in any order. Untrusted, but within limits. Of two that differ neither is kept, unless one
  /// is `asked` for: the relay alone knows where that goes.
  void take(DeltaMessage&& part, bool asked = false);
  /// Moves what is in order to `out`.
  void release(const InputRepair& inputs, std::vector<DeltaMessage>& out);
  /// Frames before this one cannot be had any more.
  void skip_to(Frame oldest);
  /// A beat says that this frame exists.
  void exists(Frame newest);

  /// True once a first delta came; before, nothing is missed.
  [[nodiscard]] bool begun() const { return next_ != 0; }
  [[nodiscard]] Frame next() const { return next_; }
  /// How many frames from next() on are missing, if it is.
  [[nodiscard]] std::uint32_t missing() const;
  /// True if a later frame came than the missing ones: they are lost, and not only late.
  [[nodiscard]] bool overtaken() const { return !held_.empty(); }
  /// The first whole frame that waits: its last_input.
  [[nodiscard]] std::optional<std::uint64_t> wanted_input() const;

 private:
  struct Held {
    std::vector<DeltaMessage> parts;  // those that did not come have no parts
    std::uint32_t came = 0;
    [[nodiscard]] bool whole() const { return came == parts.size(); }
  };
  [[nodiscard]] static bool contradicts(const Held& held, const DeltaMessage& part);
  void drop(std::map<Frame, Held>::iterator at);

  Frame next_ = 0;    // to hand out; 0: unknown
  Frame newest_ = 0;  // that exists
  std::map<Frame, Held> held_;
  std::size_t held_bytes_ = 0;
};

}  // namespace tandem::transport::nats
