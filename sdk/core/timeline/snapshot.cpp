#include "sdk/core/timeline/snapshot.hpp"

#include <string>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/layout/sections.hpp"
#include "sdk/core/timeline/input_schedule.hpp"
#include "sdk/core/timeline/snapshot_bodies.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kMagic = 0x50534454;  // "TDSP"
constexpr std::uint8_t kVersion = 3;
constexpr std::size_t kDriveBytes = 3 * 4 + 2;
constexpr std::size_t kInputBytes = 8 + 8 + kDriveBytes;
constexpr std::size_t kHeaderBytes = 4 + 1 + 8 + 4 + 4 + 8 + 8 + kDriveBytes + 8 + 4;
constexpr std::size_t kSections = 5;
// Far from overflow of any frame arithmetic; 10^11 years.
constexpr Frame kMaxFrame = Frame{1} << 62U;

void put_drive(const Drive& drive, ByteWriter& out) {
  for (const std::int32_t g : drive.gravity) out.put(g);
  out.put(drive.damping);
}

Drive get_drive(ByteReader& in) {
  Drive drive;
  for (std::int32_t& g : drive.gravity) g = in.get<std::int32_t>();
  drive.damping = in.get<std::uint16_t>();
  return drive;
}

void write_inputs(std::span<const ScheduledDrive> inputs, ByteWriter& out) {
  for (const ScheduledDrive& input : inputs) {
    out.put(input.number);
    out.put(input.frame);
    put_drive(input.drive, out);
  }
}

Result<void> read_inputs(std::span<const std::byte> section, Snapshot& snapshot) {
  if (section.empty() || section.size() > kMaxPendingInputs * kInputBytes)
    return fail(ErrorCode::kMalformed,
                "snapshot with no or too many scheduled inputs in a section of theirs");
  ByteReader in(section);
  std::uint64_t previous = 0;
  while (in.remaining() > 0) {
    ScheduledDrive input;
    input.number = in.get<std::uint64_t>();
    input.frame = in.get<std::uint64_t>();
    input.drive = get_drive(in);
    if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated scheduled input in a snapshot");
    if (input.number <= previous || input.number > snapshot.last_input || input.frame <= snapshot.frame ||
        !valid_drive(input.drive)) {
      return fail(ErrorCode::kMalformed, "impossible scheduled input in a snapshot");
    }
    previous = input.number;
    snapshot.pending.push_back(input);
  }
  return {};
}

Result<void> read_all_parameters(std::span<const std::byte> section, Snapshot& snapshot) {
  const auto named = read_parameters(section, snapshot.parameters);
  if (!named) return tl::unexpected<Error>(named.error());
  if (*named != parameter_count(snapshot.parameters))
    return fail(ErrorCode::kMalformed, "snapshot without all parameters");
  return {};
}

}  // namespace

std::size_t snapshot_bytes_bound(const State& state, const Codec& codec, const SnapshotExtras& extras) {
  return kHeaderBytes + kSections * kMaxSectionHeaderBytes + kMaxParametersBytes +
         kMaxPendingInputs * kInputBytes + bodies_bytes_bound(state, codec) +
         (extras.world != nullptr ? SessionWorld::kMaxBytes : 0) +
         (extras.data != nullptr ? extras.data->bytes_bound() : 0);
}

void write_snapshot(const Snapshot& snapshot, const State& state, const Codec& codec, ByteWriter& out,
                    const SnapshotExtras& extras) {
  out.put(kMagic);
  out.put(kVersion);
  out.put(snapshot.epoch);
  out.put(snapshot.stream.id);
  out.put(snapshot.stream.generation);
  out.put(snapshot.frame);
  out.put(snapshot.last_input);
  put_drive(snapshot.drive, out);
  out.put(snapshot.hash);
  out.put(state.capacity());
  put_section(SectionType::kParameters, out,
              [&](ByteWriter& body) { write_parameters(snapshot.parameters, nullptr, body); });
  if (!snapshot.pending.empty()) {
    put_section(SectionType::kInputs, out, [&](ByteWriter& body) { write_inputs(snapshot.pending, body); });
  }
  put_section(SectionType::kBodies, out,
              [&](ByteWriter& body) { write_bodies(snapshot.leaves_hash, state, codec, body); });
  if (extras.world != nullptr)
    put_section(SectionType::kWorld, out, [&](ByteWriter& body) { extras.world->write(body); });
  if (extras.data != nullptr)
    put_section(SectionType::kAllData, out,
                [&](ByteWriter& body) { extras.data->write(state.alive(), body); });
}

void write_snapshot(const Snapshot& snapshot, const State& state, const Codec& codec,
                    std::vector<std::byte>& out, const SnapshotExtras& extras) {
  out.resize(snapshot_bytes_bound(state, codec, extras));
  ByteWriter writer(out);
  write_snapshot(snapshot, state, codec, writer, extras);
  TANDEM_ASSERT(!writer.overflow());
  out.resize(writer.size());
}

Result<Snapshot> read_snapshot(std::span<const std::byte> bytes, TypeId type_count, State& state,
                               Codec& codec, const WorldFeatures& features, BodyData* data) {
  ByteReader in(bytes);
  if (in.get<std::uint32_t>() != kMagic) return fail(ErrorCode::kMalformed, "not a snapshot");
  if (const auto version = in.get<std::uint8_t>(); version != kVersion) {
    return fail(ErrorCode::kUnsupported, "snapshot of version " + std::to_string(version));
  }
  Snapshot snapshot;
  snapshot.epoch = in.get<Epoch>();
  snapshot.stream.id = in.get<std::uint32_t>();
  snapshot.stream.generation = in.get<std::uint32_t>();
  snapshot.frame = in.get<Frame>();
  snapshot.last_input = in.get<std::uint64_t>();
  snapshot.drive = get_drive(in);
  snapshot.hash = in.get<std::uint64_t>();
  const auto capacity = in.get<std::uint32_t>();
  if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated snapshot");
  if (snapshot.frame > kMaxFrame || !valid_drive(snapshot.drive))
    return fail(ErrorCode::kMalformed, "snapshot with a frame or drive out of range");
  if (capacity != state.capacity()) return fail(ErrorCode::kMalformed, "snapshot of another capacity");

  std::uint8_t previous = 0;  // known sections ascend, each once
  bool has_bodies = false, has_data = false;
  while (in.remaining() > 0) {
    const auto section = next_section(in);
    if (!section) return tl::unexpected<Error>(section.error());
    const auto type = static_cast<SectionType>(section->type);
    Result<void> read;
    const bool is_world = type == SectionType::kWorld && features.any();
    const bool is_data = type == SectionType::kAllData && data != nullptr;
    if (type == SectionType::kParameters || type == SectionType::kInputs || type == SectionType::kBodies ||
        is_world || is_data) {
      const bool first = previous == 0;
      if (section->type <= previous || (first && type != SectionType::kParameters))
        return fail(ErrorCode::kMalformed, "snapshot with sections out of order or repeated");
      previous = section->type;
    }
    if (type == SectionType::kParameters) {
      read = read_all_parameters(section->body, snapshot);
    } else if (type == SectionType::kInputs) {
      read = read_inputs(section->body, snapshot);
    } else if (type == SectionType::kBodies) {
      read = read_bodies(section->body, type_count, state, codec).map([&](std::uint64_t hash) {
        snapshot.leaves_hash = hash;
      });
      has_bodies = true;
    } else if (is_world) {
      read = SessionWorld::read(section->body, features).map([&](SessionWorld&& world) {
        snapshot.world = std::move(world);
      });
    } else if (is_data) {
      // Behind the bodies, as it tells of living ones alone.
      if (!has_bodies) return fail(ErrorCode::kMalformed, "snapshot with data before its bodies");
      read = data->read(section->body, state.alive());
      has_data = true;
    } else {
      read = skip_section(section->type);
    }
    if (!read) return tl::unexpected<Error>(read.error());
  }
  if (!has_bodies) return fail(ErrorCode::kMalformed, "snapshot without its bodies");
  if (features.any() && !snapshot.world) return fail(ErrorCode::kMalformed, "snapshot without its world");
  if (data != nullptr && !has_data) return fail(ErrorCode::kMalformed, "snapshot without its data");
  return snapshot;
}

}  // namespace tandem
