#include "sdk/core/timeline/snapshot.hpp"

#include <algorithm>
#include <bit>
#include <string>

#include "sdk/core/codec/bits.hpp"
#include "sdk/core/layout/sections.hpp"
#include "sdk/core/timeline/input_schedule.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kMagic = 0x50534454;  // "TDSP"
constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kRun = 64;  // bodies packed with one width
constexpr std::size_t kDriveBytes = 3 * 4 + 2;
constexpr std::size_t kInputBytes = 8 + 8 + kDriveBytes;
constexpr std::size_t kHeaderBytes = 4 + 1 + 8 + 4 + 4 + 8 + 8 + kDriveBytes + 8 + 4;
constexpr std::size_t kRegionHeaderBytes = 1 + 8;  // of region 0
constexpr std::size_t kSections = 3;
// Far from overflow of any frame arithmetic; 10^11 years.
constexpr Frame kMostFrame = Frame{1} << 62U;

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

// Frame of reference: per run of 64 bodies the width of the largest difference, the least value, and
// differences.
template <class T>
void pack_column(std::span<const T> column, std::span<const Slot> bodies, ByteWriter& out) {
  for (std::size_t at = 0; at < bodies.size(); at += kRun) {
    const auto run = bodies.subspan(at, std::min(kRun, bodies.size() - at));
    T least = column[run[0]];
    T most = least;
    for (const Slot slot : run) {
      least = std::min(least, column[slot]);
      most = std::max(most, column[slot]);
    }
    const auto base = static_cast<std::uint32_t>(least);
    const auto width = static_cast<unsigned>(std::bit_width(static_cast<std::uint32_t>(most) - base));
    out.put(static_cast<std::uint8_t>(width));
    out.put(least);
    BitWriter bits(out.rest().data());
    for (const Slot slot : run) bits.put(static_cast<std::uint32_t>(column[slot]) - base, width);
    bits.finish();
    out.advance((run.size() * width + 7) / 8);
  }
}

template <class T>
Result<void> unpack_column(ByteReader& in, std::span<const Slot> bodies, std::int64_t least_allowed,
                           std::int64_t most_allowed, std::span<T> column) {
  for (std::size_t at = 0; at < bodies.size(); at += kRun) {
    const auto run = bodies.subspan(at, std::min(kRun, bodies.size() - at));
    const unsigned width = in.get<std::uint8_t>();
    const std::int64_t least = in.get<T>();
    if (width > 32) return fail(ErrorCode::kMalformed, "snapshot column wider than 32 bits");
    const std::span<const std::byte> packed = in.get_bytes((run.size() * width + 7) / 8);
    if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated snapshot column");
    BitReader bits(packed);
    for (const Slot slot : run) {
      bits.refill();
      const std::int64_t value = least + bits.take(width);
      if (value < least_allowed || value > most_allowed) {
        return fail(ErrorCode::kMalformed, "snapshot value out of range in slot " + std::to_string(slot));
      }
      column[slot] = static_cast<T>(value);
    }
    if (!bits.at_end()) return fail(ErrorCode::kMalformed, "snapshot column with padding that is not zero");
  }
  return {};
}

std::span<const std::uint8_t> numbers(std::span<const std::byte> column) {
  return {reinterpret_cast<const std::uint8_t*>(column.data()), column.size()};
}
std::span<std::uint8_t> numbers(std::span<std::byte> column) {
  return {reinterpret_cast<std::uint8_t*>(column.data()), column.size()};
}

Result<std::vector<Slot>> read_alive(ByteReader& in, State& state) {
  const std::uint32_t capacity = state.capacity();
  const std::span<const std::byte> mask = in.get_bytes((capacity + 7U) / 8U);
  if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated snapshot mask");
  std::vector<Slot> bodies;
  for (std::uint32_t slot = 0; slot < mask.size() * 8; ++slot) {
    if (((std::to_integer<unsigned>(mask[slot / 8]) >> (slot % 8)) & 1U) == 0) continue;
    if (slot >= capacity) return fail(ErrorCode::kMalformed, "snapshot mask names slots beyond the capacity");
    state.alive()[slot] = 1;
    bodies.push_back(slot);
  }
  return bodies;
}

void write_alive(const State& state, ByteWriter& out) {
  for (Slot first = 0; first < state.capacity(); first += 8) {
    unsigned bits = 0;
    for (Slot i = 0; i < std::min<Slot>(8, state.capacity() - first); ++i) {
      bits |= static_cast<unsigned>(state.alive()[first + i]) << i;
    }
    out.put(static_cast<std::uint8_t>(bits));
  }
}

Result<void> read_columns(ByteReader& in, std::span<const Slot> bodies, TypeId type_count, State& state) {
  if (auto r = unpack_column(in, bodies, 0, UINT8_MAX, state.reuse()); !r) return r;
  if (auto r = unpack_column(in, bodies, 0, type_count - 1, state.type()); !r) return r;
  if (auto r = unpack_column(in, bodies, 0, 1, state.rest()); !r) return r;
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    if (auto r = unpack_column(in, bodies, -kPositionLimit, kPositionLimit, state.p(i)); !r) return r;
  }
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    if (auto r = unpack_column(in, bodies, -kVelocityLimit, kVelocityLimit, state.v(i)); !r) return r;
  }
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    if (auto r = unpack_column(in, bodies, -kVelocityLimit, kVelocityLimit, state.c(i)); !r) return r;
  }
  return {};
}

// Region 0, the only one: everything.
void write_region(const Snapshot& snapshot, const State& state, const Codec& codec, ByteWriter& out) {
  std::vector<Slot> bodies;
  for (Slot slot = 0; slot < state.capacity(); ++slot) {
    if (state.alive()[slot] != 0) bodies.push_back(slot);
  }
  out.put_leb128(0);
  out.put(snapshot.region_hash);
  write_alive(state, out);
  pack_column(state.reuse(), bodies, out);
  pack_column(state.type(), bodies, out);
  pack_column(state.rest(), bodies, out);
  for (std::size_t i = 0; i < kPositionChannels; ++i) pack_column(state.p(i), bodies, out);
  for (std::size_t i = 0; i < kPositionChannels; ++i) pack_column(state.v(i), bodies, out);
  for (std::size_t i = 0; i < kPositionChannels; ++i) pack_column(state.c(i), bodies, out);
  const std::span<const std::byte> columns = codec.columns();
  for (std::size_t at = 0; at < columns.size(); at += state.capacity())
    pack_column(numbers(columns.subspan(at, state.capacity())), bodies, out);
  codec.save_models(out);
}

Result<void> read_region(std::span<const std::byte> section, TypeId type_count, Snapshot& snapshot,
                         State& state, Codec& codec) {
  ByteReader in(section);
  if (in.get_leb128(kMostSectionLengthBytes) != 0 && in.ok())
    return fail(ErrorCode::kMalformed, "snapshot of a region that the stream does not have");
  snapshot.region_hash = in.get<std::uint64_t>();
  state = State(state.capacity());
  const auto bodies = read_alive(in, state);
  if (!bodies) return tl::unexpected<Error>(bodies.error());
  if (auto columns = read_columns(in, *bodies, type_count, state); !columns) return columns;
  std::vector<std::byte> columns(codec.columns().size());
  for (std::size_t at = 0; at < columns.size(); at += state.capacity()) {
    const auto column = numbers(std::span(columns).subspan(at, state.capacity()));
    if (auto r = unpack_column(in, *bodies, 0, UINT8_MAX, column); !r) return r;
  }
  return codec.load(columns, in.get_bytes(in.remaining()));
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
  if (*named != kParameterCount) return fail(ErrorCode::kMalformed, "snapshot without all parameters");
  return {};
}

}  // namespace

std::size_t snapshot_bytes_bound(std::uint32_t capacity, const Codec& codec) {
  const std::size_t runs = (capacity + kRun - 1) / kRun;
  const auto column_bytes = [&](std::size_t width) {
    return runs * (1 + width) + width * std::size_t{capacity};
  };
  return kHeaderBytes + kSections * kMostSectionHeaderBytes + kMostParametersBytes +
         kMaxPendingInputs * kInputBytes + kRegionHeaderBytes + (capacity + 7U) / 8U + 2 * column_bytes(1) +
         column_bytes(2) + 3 * kPositionChannels * column_bytes(4) +
         codec.columns().size() / std::max(capacity, 1U) * column_bytes(1) + codec.models_bound();
}

void write_snapshot(const Snapshot& snapshot, const State& state, const Codec& codec, ByteWriter& out) {
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
  put_section(SectionType::kRegion, out,
              [&](ByteWriter& body) { write_region(snapshot, state, codec, body); });
}

Result<Snapshot> read_snapshot(std::span<const std::byte> bytes, TypeId type_count, State& state,
                               Codec& codec) {
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
  if (snapshot.frame > kMostFrame || !valid_drive(snapshot.drive))
    return fail(ErrorCode::kMalformed, "snapshot with a frame or drive out of range");
  if (capacity != state.capacity()) return fail(ErrorCode::kMalformed, "snapshot of another capacity");

  std::uint8_t previous = 0;  // known sections ascend, each once
  bool has_region = false;
  while (in.remaining() > 0) {
    const auto section = next_section(in);
    if (!section) return tl::unexpected<Error>(section.error());
    const auto type = static_cast<SectionType>(section->type);
    Result<void> read;
    if (type == SectionType::kParameters || type == SectionType::kInputs || type == SectionType::kRegion) {
      const bool first = previous == 0;
      if (section->type <= previous || (first && type != SectionType::kParameters))
        return fail(ErrorCode::kMalformed, "snapshot with sections out of order or repeated");
      previous = section->type;
    }
    if (type == SectionType::kParameters) {
      read = read_all_parameters(section->body, snapshot);
    } else if (type == SectionType::kInputs) {
      read = read_inputs(section->body, snapshot);
    } else if (type == SectionType::kRegion) {
      read = read_region(section->body, type_count, snapshot, state, codec);
      has_region = true;
    } else {
      read = skip_section(section->type);
    }
    if (!read) return tl::unexpected<Error>(read.error());
  }
  if (!has_region) return fail(ErrorCode::kMalformed, "snapshot without its region");
  return snapshot;
}

}  // namespace tandem
