#pragma once
// The bytes that a joining client needs to start at one frame: idl/PROTOCOL.md, "Snapshot".

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/core/data/body_data.hpp"
#include "sdk/core/news/session_world.hpp"
#include "sdk/core/timeline/timeline.hpp"

namespace tandem {

/// A snapshot cut right after delta `frame`.
struct Snapshot {
  Epoch epoch = 0;
  StreamId stream;
  Frame frame = 0;
  std::uint64_t last_input = 0;
  Drive drive;
  StreamParameters parameters;
  std::uint64_t hash = 0;                  ///< hash of the state
  std::uint64_t leaves_hash = 0;           ///< hash of all leaves
  std::vector<ScheduledDrive> pending;     ///< ascending by number, all <= last_input, frames beyond `frame`
  std::optional<SessionWorld> world = {};  ///< only of one that was read
};

/// What a snapshot has beside bodies; null where session or stream have none.
struct SnapshotExtras {
  const SessionWorld* world = nullptr;
  const BodyData* data = nullptr;
};

/// Maximum number of bytes that write_snapshot() writes.
[[nodiscard]] std::size_t snapshot_bytes_bound(const State& state, const Codec& codec,
                                               const SnapshotExtras& extras = {});

/// Writes `snapshot`, `state`, the codec's state and `extras`.
void write_snapshot(const Snapshot& snapshot, const State& state, const Codec& codec, ByteWriter& out,
                    const SnapshotExtras& extras = {});

/// Does the same into a vector and replaces its content.
void write_snapshot(const Snapshot& snapshot, const State& state, const Codec& codec,
                    std::vector<std::byte>& out, const SnapshotExtras& extras = {});

/// Reads untrusted bytes: fills `state` (whose capacity must match) and loads `codec`. A world is there if
/// the session has `features`, and only then; `data` likewise (null: the stream has none). Checks every
/// range; the caller checks the hashes. After an error the content of `state`, `codec` and `data` is
/// undefined. Errors: kMalformed, kUnsupported (version).
[[nodiscard]] Result<Snapshot> read_snapshot(std::span<const std::byte> bytes, TypeId type_count,
                                             State& state, Codec& codec, const WorldFeatures& features = {},
                                             BodyData* data = nullptr);

}  // namespace tandem
