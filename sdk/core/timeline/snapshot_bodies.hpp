#pragma once
// The bodies of a snapshot, and what the codec remembers about them. idl/PROTOCOL.md, "Snapshot".

#include <cstddef>
#include <cstdint>
#include <span>

#include "sdk/core/codec/codec.hpp"

namespace tandem {

/// Maximum number of bytes that write_bodies() writes.
[[nodiscard]] std::size_t bodies_bytes_bound(const State& state, const Codec& codec);

/// Writes all bodies. `leaves_hash`: the hash of all leaves.
void write_bodies(std::uint64_t leaves_hash, const State& state, const Codec& codec, ByteWriter& out);

/// Reads untrusted bytes: replaces `state`, loads `codec` and returns the hash, which the caller checks.
/// After an error the content of both is undefined. Errors: kMalformed.
[[nodiscard]] Result<std::uint64_t> read_bodies(std::span<const std::byte> section, TypeId type_count,
                                                State& state, Codec& codec);

}  // namespace tandem
