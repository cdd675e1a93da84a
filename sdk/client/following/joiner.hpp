#pragma once
// Decides when to ask for a snapshot, and which one to take.

#include <algorithm>
#include <cstdint>
#include <optional>

#include "sdk/wire/messages.hpp"

namespace tandem::client {

/// One join, from the first `joining` to the snapshot taken. Sans-I/O: the caller sends the acknowledgements
/// and hands in the snapshots. Holds at most one snapshot. Not thread-safe.
class Joiner {
 public:
  /// Minimum time between two attempts; keeps a client that fails at once from asking on every frame.
  static constexpr std::int64_t kMinSpacingNs = 100'000'000;
  /// If no delta is buffered, for example while the server is suspended: how long to wait for snapshots that
  /// are newer than the request. The server answers within 0.26 s (10 ms of collecting, 250 ms between
  /// snapshots). A snapshot that was made for an earlier joiner arrives before that.
  static constexpr std::int64_t kQuietNs = 300'000'000;
  /// Time after which to ask again if nothing usable came. It doubles each time, up to kMaxPatienceNs.
  static constexpr std::int64_t kPatienceNs = 1'000'000'000;
  static constexpr std::int64_t kMaxPatienceNs = 5'000'000'000;

  /// `attempts`: attempts in earlier epochs. The numbers continue, because a server that comes back remembers
  /// those it served.
  explicit Joiner(std::uint32_t attempts = 0) : attempt_(attempts) {}

  /// Begins a join. `attempt()` counts up when it is time to ask, so that the server sees a new request.
  void start(std::int64_t now_ns);
  /// Call if a snapshot could not be used: asks again after a quarter of the patience.
  void ask_again(std::int64_t now_ns);
  /// Returns true if a new request is due now; `attempt()` has then changed.
  bool poll(std::int64_t now_ns);

  /// Call when a part of a snapshot came. The next request is delayed until no part has come for as long as
  /// the patience.
  void progress(std::int64_t now_ns);
  /// Takes a snapshot and keeps the newest. Snapshots before the first request are ignored, because they
  /// cannot be an answer.
  void offer(transport::SnapshotMessage&& snapshot);
  /// Takes the snapshot to start from, if there is one. With buffered deltas, it must not be older than the
  /// first complete one - 1; a snapshot that is too old is dropped. Without buffered deltas, it is the newest
  /// that came within kQuietNs of the request.
  [[nodiscard]] std::optional<transport::SnapshotMessage> choose(std::optional<Frame> first_buffered,
                                                                 std::int64_t now_ns);

  /// Another joiner of the same client has asked up to `attempt` meanwhile.
  void continue_after(std::uint32_t attempt) { attempt_ = std::max(attempt_, attempt); }

  [[nodiscard]] std::uint32_t attempt() const { return attempt_; }
  [[nodiscard]] bool asked() const { return asked_; }
  /// When poll() or choose() may have a new result.
  [[nodiscard]] std::int64_t next_due_ns() const;

 private:
  std::uint32_t attempt_;
  bool asked_ = false;
  std::int64_t asked_ns_ = 0;
  std::int64_t ask_due_ns_ = 0;
  std::int64_t patience_ns_ = kPatienceNs;
  std::optional<transport::SnapshotMessage> held_;
};

}  // namespace tandem::client
