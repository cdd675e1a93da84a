#pragma once
// Section 0x8b in a payload, for readers.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/layout/sections.hpp"

namespace tandem {

/// The body of the section of data that the payload begins with, behind the frame's news, if there is one;
/// `payload` becomes what stands behind it. Untrusted. Errors: kMalformed.
[[nodiscard]] inline Result<std::optional<std::span<const std::byte>>> take_data(
    std::span<const std::byte>& payload) {
  ByteReader in(payload);
  while (in.remaining() > 0) {
    const auto section = next_section(in);
    if (!section) return tl::unexpected<Error>(section.error());
    if (section->type == static_cast<std::uint8_t>(SectionType::kData)) {
      payload = payload.last(in.remaining());
      return section->body;
    }
    // Behind one that may be skipped it may follow; whoever reads the rest skips it again.
    if ((section->type & kCriticalSection) != 0) break;
  }
  return std::nullopt;
}

/// Writes which slots live after lifecycle records, which were checked against `alive`.
inline void list_living(std::span<const std::uint8_t> alive, std::span<const LifecycleRecord> lifecycle,
                        std::vector<std::uint8_t>& after) {
  after.assign(alive.begin(), alive.end());
  for (const LifecycleRecord& record : lifecycle) {
    if (record.kind == LifecycleKind::kSpawn) after[record.slot] = 1;
    if (record.kind == LifecycleKind::kDespawn) after[record.slot] = 0;
  }
}

}  // namespace tandem
