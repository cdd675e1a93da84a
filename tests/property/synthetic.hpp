#pragma once
// Seeded synthetic states, targets and lifecycle records: what tests of codecs and timelines are fed with.

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/codec/paper/code_tables.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "tests/property/random.hpp"

namespace tandem::synthetic {

inline constexpr TypeId kTypes = 3;

inline constexpr Groups kTurning{.orientation = true};
/// The radii of a stream with orientations, by type.
inline constexpr std::array<std::int32_t, kTypes> kRadii{1, 3000, 40'000'000};

inline BodyState random_body(Random& random, const Groups& groups = {}) {
  BodyState body;
  for (std::int32_t& p : body.p) p = random.value(kPositionLimit);
  for (std::int32_t& v : body.v) v = random.value(kVelocityLimit);
  if (!groups.orientation) return body;
  // Integers alone, so that golden sessions are the same whatever a compiler does to floating point.
  body.q = kNoTurn;
  for (int i = 0; i < 3; ++i) body.q = turned(body.q, any_spin(random));
  body.w = any_spin(random);
  return body;
}

/// One slot in `dead_one_in` is dead (0: none).
inline State random_state(Random& random, std::uint32_t capacity, std::uint64_t dead_one_in = 4,
                          const Groups& groups = {}) {
  State state(capacity, groups);
  for (Slot slot = 0; slot < capacity; ++slot) {
    if (dead_one_in != 0 && random.one_in(dead_one_in)) continue;
    // One draw a statement: compilers differ in the order in which they evaluate arguments.
    const BodyState body = random_body(random, groups);
    const auto type = static_cast<TypeId>(random.below(kTypes));
    const auto generation = static_cast<std::uint8_t>(random.below(256));
    state.spawn(slot, generation, type, body);
  }
  return state;
}

/// Returns `state` with one of `moved_one_in` alive bodies moved (0: none), mostly a little, sometimes to
/// anywhere.
inline State random_target(Random& random, const State& state, std::uint64_t moved_one_in) {
  State target = state;
  for (Slot slot = 0; slot < state.capacity(); ++slot) {
    if (state.alive()[slot] == 0 || moved_one_in == 0 || !random.one_in(moved_one_in)) continue;
    BodyState body = state.body(slot);
    if (random.one_in(10)) body = random_body(random, state.groups());
    const auto shifted = [&random](std::int32_t from, std::int32_t by, std::int32_t limit) {
      return std::clamp(from + random.value(by), -limit, limit);
    };
    for (std::int32_t& p : body.p) p = shifted(p, 1 << 14, kPositionLimit);
    for (std::int32_t& v : body.v) v = shifted(v, 1 << 16, kVelocityLimit);
    if (state.groups().orientation && random.one_in(2)) {
      Spin by = any_spin(random);
      for (std::int32_t& a : by) a /= 16;
      body.q = turned(body.q, by);
      body.w = random.one_in(2) ? by : body.w;
    }
    target.set_body(slot, body);
  }
  return target;
}

/// A body after a teleport.
inline BodyState teleported(BodyState body, const LifecycleRecord& record) {
  if ((record.groups & kMovesPosition) != 0) {
    body.p = record.body.p;
    body.v = record.body.v;
  }
  if ((record.groups & kMovesOrientation) != 0) {
    body.q = record.body.q;
    body.w = record.body.w;
  }
  return body;
}

/// Valid records for about one slot in `one_in`, applied to `target` too.
inline std::vector<LifecycleRecord> random_lifecycle(Random& random, const State& state, State& target,
                                                     std::uint64_t one_in) {
  std::vector<LifecycleRecord> records;
  for (Slot slot = 0; slot < state.capacity(); ++slot) {
    if (!random.one_in(one_in)) continue;
    LifecycleRecord record{LifecycleKind::kSpawn, slot, static_cast<std::uint8_t>(random.below(256)),
                           static_cast<TypeId>(random.below(kTypes)), random_body(random, state.groups())};
    if (state.alive()[slot] == 0) {
      records.push_back(record);
      target.spawn(slot, record.reuse, record.type, record.body);
      continue;
    }
    switch (random.below(4)) {
      case 0:
        records.push_back({LifecycleKind::kDespawn, slot, 0, 0, {}});
        target.despawn(slot);
        break;
      case 1:
        records.push_back({LifecycleKind::kDespawn, slot, 0, 0, {}});
        records.push_back(record);
        target.spawn(slot, record.reuse, record.type, record.body);
        break;
      case 2:
        record.kind = LifecycleKind::kTeleport;
        record.groups = bits_of(state.groups());
        if (state.groups().orientation) record.groups = static_cast<std::uint8_t>(1 + random.below(3));
        target.set_body(slot, teleported(target.body(slot), record));
        records.push_back(record);
        break;
      default:
        records.push_back({LifecycleKind::kTypeChange, slot, 0, record.type, {}});
        target.type()[slot] = record.type;
        break;
    }
  }
  return records;
}

/// The tables that make_codec() wants for a name.
inline std::vector<std::byte> tables_for(std::string_view codec, const Groups& groups = {}) {
  return codec_traits(codec)->takes_tables ? default_code_tables(groups) : std::vector<std::byte>{};
}

inline std::unique_ptr<Codec> codec_of(std::string_view name, std::uint32_t capacity,
                                       const RunBlocks& run_blocks = {}, const Groups& groups = {}) {
  const auto tables = tables_for(name, groups);
  const std::span<const std::int32_t> radii(kRadii);
  return std::move(*make_codec({.name = name,
                                .capacity = capacity,
                                .tables = tables,
                                .groups = groups,
                                .radii = radii.first(groups.orientation ? radii.size() : 0),
                                .run_blocks = run_blocks}));
}

inline DeltaCodec make_delta(std::string_view codec, std::uint32_t capacity,
                             const StreamParameters& parameters, const RunBlocks& run_blocks = {},
                             const Groups& groups = {}) {
  return {codec_of(codec, capacity, run_blocks, groups), capacity, parameters, kTypes, groups};
}

/// `parameters` of a stream that lists the steps of turns if its codec reads them.
inline StreamParameters with_turn_steps(StreamParameters parameters, std::string_view codec,
                                        const Groups& groups) {
  if (!groups.orientation || !codec_traits(codec)->reads_steps) return parameters;
  parameters.codec.turn_step = 1 << 20;
  parameters.codec.spin_step = 1 << 18;
  return parameters;
}

/// A codec and the groups of a stream that it can code.
struct Coded {
  std::string_view codec;
  Groups groups;
};
inline std::vector<Coded> all_coded() {
  std::vector<Coded> all;
  for (const std::string_view name : codec_names()) all.push_back({name, {}});
  for (const std::string_view name : codec_names()) {
    if (codec_traits(name)->turns) all.push_back({name, {.orientation = true}});
  }
  return all;
}

/// A client's part: decodes `payload` against `state`, then applies it.
inline Result<void> receive(DeltaCodec& client, State& state, std::span<const std::byte> payload) {
  return client.decode(state, payload).map([&](const Delta& delta) { client.apply(delta, state); });
}

/// Checks the rules that every state must keep, whatever bytes it came from. Returns the broken rule, or
/// null.
inline const char* broken_invariant(const State& state) {
  const auto within = [](std::int32_t value, std::int32_t limit) {
    return -limit <= value && value <= limit;
  };
  for (Slot slot = 0; slot < state.capacity(); ++slot) {
    if (state.alive()[slot] > 1) return "alive is neither 0 nor 1";
    if (state.type()[slot] >= kTypes) return "type that the session does not list";
    const bool dead = state.alive()[slot] == 0;
    if (dead && (state.reuse()[slot] != 0 || state.type()[slot] != 0)) return "dead slot is not zero";
    if (state.groups().orientation) {
      const BodyState body = state.body(slot);
      if (dead && (body.q != Quaternion{} || body.w != Spin{})) return "dead slot is not zero";
      if (!dead && (!valid_quaternion(body.q) || !valid_spin(body.w))) return "no orientation";
    }
    for (std::size_t i = 0; i < kPositionChannels; ++i) {
      const std::int32_t p = state.p(i)[slot];
      const std::int32_t v = state.v(i)[slot];
      const std::int32_t c = state.c(i)[slot];
      if (dead && (p != 0 || v != 0 || c != 0)) return "dead slot is not zero";
      if (!within(p, kPositionLimit) || !within(v, kVelocityLimit) || !within(c, kVelocityLimit))
        return "limits";
    }
    if (!state.groups().orientation) continue;
    const BodyState body = state.body(slot);
    if (dead && (body.q != Quaternion{} || body.w != Spin{})) return "dead slot is not zero";
    if (!dead && (!valid_quaternion(body.q) || !valid_spin(body.w))) return "no turn";
  }
  return nullptr;
}

/// Flips, overwrites, cuts, extends or repeats some of the bytes.
inline void mutate(Random& random, std::vector<std::byte>& bytes) {
  for (std::uint64_t changes = 1 + random.below(4); changes > 0; --changes) {
    const auto at = [&bytes, &random] { return static_cast<std::ptrdiff_t>(random.below(bytes.size())); };
    const auto any = [&random] { return static_cast<std::byte>(random.below(256)); };
    switch (bytes.empty() ? 4 : random.below(7)) {
      case 0:
        bytes[static_cast<std::size_t>(at())] ^= static_cast<std::byte>(1U << random.below(8));
        break;
      case 1:
        bytes[static_cast<std::size_t>(at())] = any();
        break;
      case 2:
        bytes.resize(static_cast<std::size_t>(at()));
        break;
      case 3:
        bytes.erase(bytes.begin() + at());
        break;
      case 4:
        for (std::uint64_t count = 1 + random.below(8); count > 0; --count) bytes.push_back(any());
        break;
      case 5:
        bytes.insert(bytes.begin() + at(), any());
        break;
      default: {
        const std::vector<std::byte> tail(bytes.begin() + at(), bytes.end());
        bytes.insert(bytes.end(), tail.begin(), tail.end());
        break;
      }
    }
  }
}

/// The memory of a codec: its columns, then its models.
inline std::vector<std::byte> coder_state(const Codec& codec) {
  const std::span<const std::byte> columns = codec.columns();
  std::vector<std::byte> bytes(columns.begin(), columns.end());
  bytes.resize(columns.size() + codec.models_bits_bound());
  NumberEncoder models{std::span(bytes).subspan(columns.size())};
  codec.save_models(models);
  bytes.resize(columns.size() + models.finish());
  return bytes;
}

/// Loads it into a codec, as a snapshot would that knows of `alive` slots only.
inline Result<void> load_coder_state(Codec& codec, std::span<const std::byte> bytes,
                                     std::span<const std::uint8_t> alive) {
  const std::size_t columns = codec.columns().size();
  if (bytes.size() < columns) return fail(ErrorCode::kMalformed, "too short");
  for (std::size_t at = 0; at < columns; ++at) {
    if (bytes[at] != std::byte{0} && alive[at % alive.size()] == 0)
      return fail(ErrorCode::kMalformed, "coder state of a dead slot");
  }
  NumberDecoder models(bytes.subspan(columns));
  return codec.load(bytes.first(columns), models);
}

}  // namespace tandem::synthetic
