#pragma once
// The way into a session: when to ask for a snapshot, and which one to take.

#include <algorithm>
#include <cstdint>
#include <optional>

#include "sdk/transport/messages.hpp"

namespace tandem::client {

/// One join, from the first `joining` to the snapshot taken. Sans-I/O: the caller sends the acknowledgements
/// and hands in the snapshots. Holds one snapshot at most. Not thread-safe.
class Joiner {
 public:
  /// Between two attempts at least; keeps a client that fails at once from asking on every frame.
  static constexpr std::int64_t kMinSpacingNs = 100'000'000;
  /// With no delta buffered, as while the server is suspended: how long to wait for snapshots newer than the
  /// question. The server answers within 0.26 s (10 ms of collecting, 250 ms between snapshots); a
  /// snapshot made for an earlier joiner arrives before that.
  static constexpr std::int64_t kQuietNs = 300'000'000;
  /// Ask again when nothing usable came: first after this, then doubled up to kMaxPatienceNs.
  static constexpr std::int64_t kPatienceNs = 1'000'000'000;
  static constexpr std::int64_t kMaxPatienceNs = 5'000'000'000;

  /// `attempts`: those of earlier epochs. Numbers go on, as a server that comes back remembers those it
  /// served.
  explicit Joiner(std::uint32_t attempts = 0) : attempt_(attempts) {}

  /// Begins a join. `attempt()` counts up when it is time to ask, so that it is a new question to the server.
  void start(std::int64_t now_ns);
  /// A snapshot could not be used: ask again after a quarter of the patience.
  void ask_again(std::int64_t now_ns);
  /// Returns true when a new question is due now; `attempt()` has then changed.
  bool poll(std::int64_t now_ns);

  /// Part of a snapshot came: the next question is put off until nothing has come for as long as the
  /// patience.
  void progress(std::int64_t now_ns);
  /// Keeps the newest. Before the first question is out, snapshots are ignored: they can not be an answer.
  void offer(transport::SnapshotMessage&& snapshot);
  /// Takes the snapshot to start from, if there is one: not older than the first complete buffered delta - 1;
  /// with none buffered, the newest that came within kQuietNs of the question. One that is too old is
  /// dropped.
  [[nodiscard]] std::optional<transport::SnapshotMessage> choose(std::optional<Frame> first_buffered,
                                                                 std::int64_t now_ns);

  /// Another joiner of the same client asked up to `attempt` meanwhile.
  void continue_after(std::uint32_t attempt) { attempt_ = std::max(attempt_, attempt); }

  [[nodiscard]] std::uint32_t attempt() const { return attempt_; }
  [[nodiscard]] bool asked() const { return asked_; }
  /// When poll() or choose() may have something new to say.
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
