#include "sdk/core/codec/lifecycle.hpp"

namespace tandem {
namespace {

bool within(const Vec3i& values, std::int32_t limit) {
  return std::all_of(values.begin(), values.end(),
                     [limit](std::int32_t x) { return -limit <= x && x <= limit; });
}

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
      const bool reuse = record.slot == previous->slot && previous->kind == LifecycleKind::kDespawn &&
                         record.kind == LifecycleKind::kSpawn;
      if (!reuse) return "lifecycle records do not ascend";
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
  for (const LifecycleRecord& record : records) {
    out.put(record.slot);
    out.put(static_cast<std::uint8_t>(record.kind));
    if (record.kind == LifecycleKind::kSpawn) out.put(record.generation);
    if (carries_type(record.kind)) out.put(record.type);
    if (!carries_body(record.kind)) continue;
    for (const std::int32_t value : record.body.p) out.put(value);
    for (const std::int32_t value : record.body.v) out.put(value);
  }
}

Result<void> read_lifecycle(std::span<const std::byte> section, std::vector<LifecycleRecord>& records) {
  records.clear();
  if (section.empty()) return fail(ErrorCode::kMalformed, "lifecycle section without a record");
  ByteReader in(section);
  while (in.ok() && in.remaining() > 0) {
    LifecycleRecord record;
    record.slot = in.get<std::uint32_t>();
    const auto kind = in.get<std::uint8_t>();
    if (kind > static_cast<std::uint8_t>(LifecycleKind::kTypeChange)) {
      return fail(ErrorCode::kMalformed, "unknown kind of lifecycle record");
    }
    record.kind = static_cast<LifecycleKind>(kind);
    if (record.kind == LifecycleKind::kSpawn) record.generation = in.get<std::uint8_t>();
    if (carries_type(record.kind)) record.type = in.get<TypeId>();
    if (carries_body(record.kind)) {
      for (std::int32_t& value : record.body.p) value = in.get<std::int32_t>();
      for (std::int32_t& value : record.body.v) value = in.get<std::int32_t>();
    }
    records.push_back(record);
  }
  if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated lifecycle record");
  return {};
}

void apply_lifecycle(std::span<const LifecycleRecord> records, State& state) {
  for (const LifecycleRecord& record : records) {
    switch (record.kind) {
      case LifecycleKind::kDespawn:
        state.despawn(record.slot);
        break;
      case LifecycleKind::kSpawn:
        state.spawn(record.slot, record.generation, record.type, record.body);
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
