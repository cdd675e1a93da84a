#pragma once
// Lifecycle records as bytes: a section of a delta's payload.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/delta.hpp"

namespace tandem {

/// Maximum number of bytes for one slot: a despawn and a spawn.
[[nodiscard]] inline std::size_t most_lifecycle_bytes_per_slot(const Groups& groups) {
  return 4 + 4 + 1 + 3 + body_bytes(bits_of(groups));
}

/// Checks `records` against the rules (order, alive and dead slots, ranges), given the `alive` column.
/// Returns why they break a rule, or null. Leaves in `alive` the column after the records.
[[nodiscard]] const char* check_lifecycle(std::span<const LifecycleRecord> records,
                                          std::span<std::uint8_t> alive, TypeId type_count);

/// Appends the body of a lifecycle section.
void write_lifecycle(std::span<const LifecycleRecord> records, const Groups& groups, ByteWriter& out);

/// Reads all of `section` into `records` (replaced). Checks the layout only. Errors: kMalformed.
[[nodiscard]] Result<void> read_lifecycle(std::span<const std::byte> section, const Groups& groups,
                                          std::vector<LifecycleRecord>& records);

/// Applies the records, which must have passed check_lifecycle().
void apply_lifecycle(std::span<const LifecycleRecord> records, State& state);

}  // namespace tandem
