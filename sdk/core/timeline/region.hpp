#pragma once
// A region of a snapshot: its bodies, and what the codec remembers about them. idl/PROTOCOL.md, "Snapshot".

#include <cstddef>
#include <cstdint>
#include <span>

#include "sdk/core/codec/codec.hpp"

namespace tandem {

/// Maximum number of bytes that write_region() writes.
[[nodiscard]] std::size_t region_bytes_bound(const State& state, const Codec& codec);

/// Writes region 0, the only one, with everything in it. `hash`: the region's.
void write_region(std::uint64_t hash, const State& state, const Codec& codec, ByteWriter& out);

/// Reads untrusted bytes: replaces `state`, loads `codec` and returns the hash, which the caller checks.
/// After an error the content of both is undefined. Errors: kMalformed.
[[nodiscard]] Result<std::uint64_t> read_region(std::span<const std::byte> section, TypeId type_count,
                                                State& state, Codec& codec);

}  // namespace tandem
