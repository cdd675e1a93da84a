#pragma once
// A checkpoint as the bytes of a file. README.md describes the format.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/host/checkpoint/checkpoint.hpp"
#include "tandem/result.hpp"

namespace tandem::checkpoint {

/// The version that this build writes. It reads this one, and the one before it as soon as there is one.
inline constexpr std::uint8_t kFormatVersion = 1;
/// Larger files are refused unread: 4,194,304 bodies of the engines here take less than a tenth.
inline constexpr std::uint64_t kMaxFileBytes = std::uint64_t{4} << 30U;
/// The length of the part of a file that says how long the file is.
inline constexpr std::size_t kHeadBytes = 24;

/// Replaces the content of `out`, and keeps its memory. Errors: kInvalidArgument, with the words of decode(),
/// which would refuse the file.
[[nodiscard]] Result<void> encode(const Checkpoint& checkpoint, std::vector<std::byte>& out);

/// Reads a whole file. Untrusted; never allocates more than a small multiple of `file`. Errors, one line each
/// without the file's name: kMalformed (no checkpoint, cut short, checksum, a value out of range),
/// kUnsupported (another version, byte order, or a section that this build does not know).
[[nodiscard]] Result<Checkpoint> decode(std::span<const std::byte> file);

}  // namespace tandem::checkpoint
