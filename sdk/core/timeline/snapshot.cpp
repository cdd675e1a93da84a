#include "sdk/core/timeline/snapshot.hpp"

#include <algorithm>
#include <bit>
#include <string>

#include "sdk/core/codec/bits.hpp"
#include "sdk/core/timeline/input_schedule.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kMagic = 0x50534454;  // "TDSP"
constexpr std::uint16_t kVersion = 1;
constexpr std::size_t kRun = 64;  // bodies packed with one width
constexpr std::size_t kRunHeaderBytes = 5;
constexpr std::size_t kPendingBytes = 8 + 8 + 14;
constexpr std::size_t kFixedBytes = 4 + 2 + 8 + 8 + 8 + 14 + kParametersBytes + 8 + 4 + 4 + 2 + 4;
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

// Frame of reference: per run of 64 bodies the least value, the width of the largest difference, and
// differences.
template <class T>
void pack_column(std::span<const T> column, std::span<const Slot> bodies, ByteWriter& out) {
  for (std::size_t at = 0; at < bodies.size(); at += kRun) {
    const auto run = bodies.subspan(at, std::min(kRun, bodies.size() - at));
    auto least = static_cast<std::int32_t>(column[run[0]]);
    auto most = least;
    for (const Slot slot : run) {
      least = std::min(least, static_cast<std::int32_t>(column[slot]));
      most = std::max(most, static_cast<std::int32_t>(column[slot]));
    }
    const auto base = static_cast<std::uint32_t>(least);
    const auto width = static_cast<unsigned>(std::bit_width(static_cast<std::uint32_t>(most) - base));
    out.put(static_cast<std::uint8_t>(width));
    out.put(least);
    BitWriter bits(out.rest().data());
    for (const Slot slot : run) {
      bits.put(static_cast<std::uint32_t>(static_cast<std::int32_t>(column[slot])) - base, width);
    }
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
    const std::int64_t least = in.get<std::int32_t>();
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

Result<std::vector<Slot>> read_alive(ByteReader& in, State& state, std::uint32_t count) {
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
  if (bodies.size() != count) return fail(ErrorCode::kMalformed, "snapshot mask and body count differ");
  return bodies;
}

Result<void> read_columns(ByteReader& in, std::span<const Slot> bodies, TypeId type_count, State& state) {
  if (auto r = unpack_column(in, bodies, 0, UINT8_MAX, state.generation()); !r) return r;
  if (auto r = unpack_column(in, bodies, 0, type_count - 1, state.type()); !r) return r;
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

Result<void> read_pending(ByteReader& in, Snapshot& snapshot) {
  const std::size_t count = in.get<std::uint16_t>();
  if (count > kMaxPendingInputs)
    return fail(ErrorCode::kMalformed, "snapshot with too many scheduled inputs");
  std::uint64_t previous = 0;
  for (std::size_t i = 0; i < count; ++i) {
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

}  // namespace

std::size_t snapshot_bytes_bound(std::uint32_t capacity, std::size_t coder_bytes) {
  const std::size_t runs = (capacity + kRun - 1) / kRun;
  const std::size_t column_bytes = runs * kRunHeaderBytes + 4 * std::size_t{capacity};
  return kFixedBytes + kMaxPendingInputs * kPendingBytes + (capacity + 7U) / 8U +
         (2 + 3 * kPositionChannels) * column_bytes + coder_bytes;
}

void write_snapshot(const Snapshot& snapshot, const State& state, const Codec& codec, ByteWriter& out) {
  std::vector<Slot> bodies;
  for (Slot slot = 0; slot < state.capacity(); ++slot) {
    if (state.alive()[slot] != 0) bodies.push_back(slot);
  }
  out.put(kMagic);
  out.put(kVersion);
  out.put(snapshot.epoch);
  out.put(snapshot.frame);
  out.put(snapshot.last_input);
  put_drive(snapshot.drive, out);
  put_parameters(snapshot.parameters, out);
  out.put(snapshot.hash);
  out.put(state.capacity());
  out.put(static_cast<std::uint32_t>(bodies.size()));
  out.put(static_cast<std::uint16_t>(snapshot.pending.size()));
  for (const ScheduledDrive& input : snapshot.pending) {
    out.put(input.number);
    out.put(input.frame);
    put_drive(input.drive, out);
  }
  for (Slot first = 0; first < state.capacity(); first += 8) {
    unsigned bits = 0;
    for (Slot i = 0; i < std::min<Slot>(8, state.capacity() - first); ++i) {
      bits |= static_cast<unsigned>(state.alive()[first + i]) << i;
    }
    out.put(static_cast<std::uint8_t>(bits));
  }
  pack_column(state.generation(), bodies, out);
  pack_column(state.type(), bodies, out);
  for (std::size_t i = 0; i < kPositionChannels; ++i) pack_column(state.p(i), bodies, out);
  for (std::size_t i = 0; i < kPositionChannels; ++i) pack_column(state.v(i), bodies, out);
  for (std::size_t i = 0; i < kPositionChannels; ++i) pack_column(state.c(i), bodies, out);
  const std::size_t at = out.size();
  out.put(std::uint32_t{0});
  codec.save(out);
  out.patch_u32(at, static_cast<std::uint32_t>(out.size() - at - 4));
}

Result<Snapshot> read_snapshot(std::span<const std::byte> bytes, TypeId type_count, State& state,
                               Codec& codec) {
  ByteReader in(bytes);
  if (in.get<std::uint32_t>() != kMagic) return fail(ErrorCode::kMalformed, "not a snapshot");
  if (const auto version = in.get<std::uint16_t>(); version != kVersion) {
    return fail(ErrorCode::kUnsupported, "snapshot of version " + std::to_string(version));
  }
  Snapshot snapshot;
  snapshot.epoch = in.get<Epoch>();
  snapshot.frame = in.get<Frame>();
  snapshot.last_input = in.get<std::uint64_t>();
  snapshot.drive = get_drive(in);
  snapshot.parameters = get_parameters(in);
  snapshot.hash = in.get<std::uint64_t>();
  const auto capacity = in.get<std::uint32_t>();
  const auto count = in.get<std::uint32_t>();
  if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated snapshot");
  if (snapshot.frame > kMostFrame || !valid_drive(snapshot.drive) ||
      !valid_parameters(snapshot.parameters.codec)) {
    return fail(ErrorCode::kMalformed, "snapshot with a frame, drive or parameters out of range");
  }
  if (capacity != state.capacity()) return fail(ErrorCode::kMalformed, "snapshot of another capacity");
  if (auto pending = read_pending(in, snapshot); !pending) return tl::unexpected<Error>(pending.error());

  state = State(capacity);
  const auto bodies = read_alive(in, state, count);
  if (!bodies) return tl::unexpected<Error>(bodies.error());
  if (auto columns = read_columns(in, *bodies, type_count, state); !columns) {
    return tl::unexpected<Error>(columns.error());
  }
  const std::size_t coder_bytes = in.get<std::uint32_t>();
  if (!in.ok() || coder_bytes != in.remaining())
    return fail(ErrorCode::kMalformed, "snapshot of wrong length");
  if (auto coder = codec.load(in.get_bytes(coder_bytes), state.alive()); !coder)
    return tl::unexpected<Error>(coder.error());
  return snapshot;
}

}  // namespace tandem
