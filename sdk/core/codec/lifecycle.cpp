#include "sdk/core/codec/lifecycle.hpp"

namespace tandem {
namespace {

bool within(const Vec3i& values, std::int32_t limit) {
  return std::all_of(values.begin(), values.end(),
                     [limit](std::int32_t x) { return -limit <= x && x <= limit; });
}

constexpr std::uint32_t kKinds = 4;
constexpr std::size_t kMostHeadBytes = 4;
constexpr std::size_t kMostTypeBytes = 3;
constexpr std::uint8_t kPositionMask = 1;  // position is the first group listed, and the only one

bool carries_body(LifecycleKind kind) {
  return kind == LifecycleKind::kSpawn || kind == LifecycleKind::kTeleport;
}
bool carries_type(LifecycleKind kind) {
  return kind == LifecycleKind::kSpawn || kind == LifecycleKind::kTypeChange;
}

}  // namespace

const char* check_lifecycle(std::span<const LifecycleRecord> records, std::span<std::uint8_t> alive,
                            TypeId type_count) {
  const LifecycleRecord* previous = nullptr;
  for (const LifecycleRecord& record : records) {
    if (record.slot >= alive.size()) return "lifecycle record of a slot beyond the capacity";
    if (previous != nullptr && record.slot <= previous->slot) {
      const bool reused = record.slot == previous->slot && previous->kind == LifecycleKind::kDespawn &&
                          record.kind == LifecycleKind::kSpawn;
      if (!reused) return "lifecycle records do not ascend";
    }
    previous = &record;
    if (record.kind == LifecycleKind::kSpawn) {
      if (alive[record.slot] != 0) return "spawn into a slot that is alive";
    } else if (alive[record.slot] == 0) {
      return "despawn, teleport or type change of a dead slot";
    }
    if (carries_type(record.kind) && record.type >= type_count) return "type that the session does not list";
    if (carries_body(record.kind) &&
        (!within(record.body.p, kPositionLimit) || !within(record.body.v, kVelocityLimit))) {
      return "spawn or teleport beyond the lattice";
    }
    if (record.kind == LifecycleKind::kSpawn) alive[record.slot] = 1;
    if (record.kind == LifecycleKind::kDespawn) alive[record.slot] = 0;
  }
  return nullptr;
}

void write_lifecycle(std::span<const LifecycleRecord> records, ByteWriter& out) {
  Slot previous = 0;
  for (const LifecycleRecord& record : records) {
    out.put_leb128(std::uint64_t{record.slot - previous} * kKinds + static_cast<std::uint8_t>(record.kind));
    previous = record.slot;
    if (record.kind == LifecycleKind::kSpawn) out.put(record.reuse);
    if (carries_type(record.kind)) out.put_leb128(record.type);
    if (record.kind == LifecycleKind::kTeleport) out.put(kPositionMask);
    if (!carries_body(record.kind)) continue;
    for (const std::int32_t value : record.body.p) out.put(value);
    for (const std::int32_t value : record.body.v) out.put(value);
  }
}

Result<void> read_lifecycle(std::span<const std::byte> section, std::vector<LifecycleRecord>& records) {
  records.clear();
  if (section.empty()) return fail(ErrorCode::kMalformed, "lifecycle section without a record");
  ByteReader in(section);
  std::uint64_t slot = 0;
  while (in.ok() && in.remaining() > 0) {
    const std::uint64_t head = in.get_leb128(kMostHeadBytes);
    slot += head / kKinds;
    if (slot >= kMaxCapacity)
      return fail(ErrorCode::kMalformed, "lifecycle record of a slot beyond the capacity");
    LifecycleRecord record;
    record.slot = static_cast<Slot>(slot);
    record.kind = static_cast<LifecycleKind>(head % kKinds);
    if (record.kind == LifecycleKind::kSpawn) record.reuse = in.get<std::uint8_t>();
    if (carries_type(record.kind)) {
      const std::uint64_t type = in.get_leb128(kMostTypeBytes);
      if (type > UINT16_MAX) return fail(ErrorCode::kMalformed, "type that the session does not list");
      record.type = static_cast<TypeId>(type);
    }
    if (record.kind == LifecycleKind::kTeleport && in.get<std::uint8_t>() != kPositionMask && in.ok()) {
      return fail(ErrorCode::kMalformed, "teleport of groups that the stream does not list");
    }
    if (carries_body(record.kind)) {
      for (std::int32_t& value : record.body.p) value = in.get<std::int32_t>();
      for (std::int32_t& value : record.body.v) value = in.get<std::int32_t>();
    }
    records.push_back(record);
  }
  if (!in.ok())
    return fail(ErrorCode::kMalformed, "lifecycle record that is truncated or not in shortest form");
  return {};
}

void apply_lifecycle(std::span<const LifecycleRecord> records, State& state) {
  for (const LifecycleRecord& record : records) {
    switch (record.kind) {
      case LifecycleKind::kDespawn:
        state.despawn(record.slot);
        break;
      case LifecycleKind::kSpawn:
        state.spawn(record.slot, record.reuse, record.type, record.body);
        break;
      case LifecycleKind::kTeleport:
        state.set_body(record.slot, record.body);
        break;
      case LifecycleKind::kTypeChange:
        state.type()[record.slot] = record.type;
        break;
    }
  }
}

}  // namespace tandem
