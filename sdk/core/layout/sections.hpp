#pragma once
// Payloads and snapshots consist of typed sections. idl/PROTOCOL.md, "Payload".

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "sdk/core/lattice/bytes.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// A reader that does not know a type refuses the whole payload or snapshot if this bit is set; otherwise it
/// skips the section.
inline constexpr std::uint8_t kCriticalSection = 0x80;
enum class SectionType : std::uint8_t {
  kLifecycle = 0x81,
  kParameters = 0x82,
  kCorrections = 0x83,
  kInputs = 0x84,  ///< snapshots only, as kBodies
  kBodies = 0x85,
  kLastCorrections = 0x86,  ///< has no length: its body extends to the payload's end
  kRounding = 0x87,
  kData = 0x8b,     ///< in payloads of streams with the group `data`
  kKeys = 0x8c,     ///< in payloads of sessions with the feature `keys`
  kEvents = 0x8d,   ///< likewise `events`
  kWorld = 0x8e,    ///< in snapshots of sessions with one of these features
  kAllData = 0x8f,  ///< in snapshots of streams with the group `data`
};
inline constexpr std::size_t kMaxSectionLengthBytes = 4;
/// Maximum number of bytes before a section's body.
inline constexpr std::size_t kMaxSectionHeaderBytes = 1 + kMaxSectionLengthBytes;

/// Maximum size of a block number as LEB128.
inline constexpr std::size_t kMaxBlockNumberBytes = 4;

/// The size of a section whose body takes `body_bytes`.
[[nodiscard]] constexpr std::size_t section_bytes(std::size_t body_bytes) {
  return 1 + leb128_bytes(body_bytes) + body_bytes;
}

/// One section of a payload or a snapshot.
struct TypedSection {
  std::uint8_t type = 0;
  std::span<const std::byte> body;
};

/// Errors: kMalformed.
[[nodiscard]] inline Result<TypedSection> next_section(ByteReader& in) {
  TypedSection section;
  section.type = in.get<std::uint8_t>();
  if (section.type == static_cast<std::uint8_t>(SectionType::kLastCorrections)) {
    section.body = in.get_bytes(in.remaining());
    return section;
  }
  section.body = in.get_bytes(static_cast<std::size_t>(in.get_leb128(kMaxSectionLengthBytes)));
  if (!in.ok()) return fail(ErrorCode::kMalformed, "section that is truncated or whose length is not LEB128");
  return section;
}

/// Succeeds for a section that may be skipped. Errors: kUnsupported.
[[nodiscard]] inline Result<void> skip_section(std::uint8_t type) {
  if ((type & kCriticalSection) == 0) return {};
  return fail(ErrorCode::kUnsupported,
              "unknown critical section " + std::to_string(type & ~kCriticalSection));
}

/// Writes a section whose body write(out) appends.
template <class Write>
void put_section(SectionType type, ByteWriter& out, Write&& write) {
  out.put(static_cast<std::uint8_t>(type));
  const std::size_t at = out.size();
  write(out);
  out.put_length_before(at);
}

}  // namespace tandem
