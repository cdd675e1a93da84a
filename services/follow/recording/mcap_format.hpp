#pragma once
// The common part of writer and reader of MCAP files (mcap.dev).

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tandem::recording {

inline constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kDataEnd = 0x0F,
};

/// A chunk is never larger, nor read if it is: one with what a reader needs to begin has the announcement of
/// a session and a whole snapshot, and some small messages (recorder.cpp).
inline constexpr std::uint64_t kMaxChunkBytes = 384U << 20U;

/// Size of the head of a record: opcode and length.
inline constexpr std::size_t kRecordHead = 1 + 8;
/// The value of a checksum field if there is no checksum.
inline constexpr std::uint32_t kNoChecksum = 0;

/// CRC-32 as in IEEE 802.3 and zlib. `before`: the checksum of the bytes in front.
[[nodiscard]] std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t before = 0);

}  // namespace tandem::recording
