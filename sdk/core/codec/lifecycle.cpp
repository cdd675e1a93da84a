#include "sdk/core/codec/lifecycle.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kKinds = 4;
constexpr std::size_t kMaxHeadBytes = 4;
constexpr std::size_t kMaxTypeBytes = 3;

bool carries_body(LifecycleKind kind) {
  return kind == LifecycleKind::kSpawn || kind == LifecycleKind::kTeleport;
}
// The groups whose content a record of a spawn or teleport holds.
unsigned named(const LifecycleRecord& record, const Groups& groups) {
  return record.kind == LifecycleKind::kSpawn ? bits_of(groups) : record.groups;
}
bool carries_type(LifecycleKind kind) {
  return kind == LifecycleKind::kSpawn || kind == LifecycleKind::kTypeChange;
}

// Resets rest and c of the whole body.
void teleport(const LifecycleRecord& record, State& state) {
  BodyState body = state.body(record.slot);
  move_body(record.groups, record.body, body);
  state.renew(record.slot, body);
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
    if (carries_body(record.kind) && !valid_body(record.body)) return "spawn or teleport beyond the lattice";
    if (record.kind == LifecycleKind::kSpawn) alive[record.slot] = 1;
    if (record.kind == LifecycleKind::kDespawn) alive[record.slot] = 0;
  }
  return nullptr;
}

void write_lifecycle(std::span<const LifecycleRecord> records, const Groups& groups, ByteWriter& out) {
  Slot previous = 0;
  for (const LifecycleRecord& record : records) {
    out.put_leb128(std::uint64_t{record.slot - previous} * kKinds + static_cast<std::uint8_t>(record.kind));
    previous = record.slot;
    if (record.kind == LifecycleKind::kSpawn) out.put(record.reuse);
    if (carries_type(record.kind)) out.put_leb128(record.type);
    if (record.kind == LifecycleKind::kTeleport) out.put(record.groups);
    if (carries_body(record.kind)) put_body(named(record, groups), record.body, out);
  }
}

Result<void> read_lifecycle(std::span<const std::byte> section, const Groups& groups,
                            std::vector<LifecycleRecord>& records) {
  records.clear();
  if (section.empty()) return fail(ErrorCode::kMalformed, "lifecycle section without a record");
  ByteReader in(section);
  std::uint64_t slot = 0;
  while (in.ok() && in.remaining() > 0) {
    const std::uint64_t head = in.get_leb128(kMaxHeadBytes);
    slot += head / kKinds;
    if (slot >= kMaxCapacity)
      return fail(ErrorCode::kMalformed, "lifecycle record of a slot beyond the capacity");
    LifecycleRecord record;
    record.slot = static_cast<Slot>(slot);
    record.kind = static_cast<LifecycleKind>(head % kKinds);
    if (record.kind == LifecycleKind::kSpawn) record.reuse = in.get<std::uint8_t>();
    if (carries_type(record.kind)) {
      const std::uint64_t type = in.get_leb128(kMaxTypeBytes);
      if (type > UINT16_MAX) return fail(ErrorCode::kMalformed, "type that the session does not list");
      record.type = static_cast<TypeId>(type);
    }
    if (record.kind == LifecycleKind::kTeleport) {
      record.groups = in.get<std::uint8_t>();
      if (in.ok() && (record.groups == 0 || (record.groups & ~unsigned{bits_of(groups)}) != 0))
        return fail(ErrorCode::kMalformed, "teleport of groups that the stream does not list");
    }
    if (carries_body(record.kind)) get_body(named(record, groups), in, record.body);
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
        teleport(record, state);
        break;
      case LifecycleKind::kTypeChange:
        state.type()[record.slot] = record.type;
        break;
    }
  }
}

}  // namespace tandem
