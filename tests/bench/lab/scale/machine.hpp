#pragma once
// What this machine's memory can do.

#include <cstdint>

namespace tandem::lab {

/// Bytes a second, read and written together, of copies between two arrays that no cache holds. Takes about
/// half a second and 512 MB.
[[nodiscard]] double memory_bytes_per_s(std::uint32_t threads);

/// Bytes of memory that programs may still take; 0 where the system does not say.
[[nodiscard]] std::uint64_t free_memory_bytes();

/// Bytes that this process's heap holds, with the allocator's overhead.
[[nodiscard]] std::int64_t heap_bytes();

}  // namespace tandem::lab
