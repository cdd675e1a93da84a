#pragma once
// The state hash that every delta carries: XXH3-64, seed 0.

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// Hashes columns one after another, little-endian. Keeps its working memory, so hashing allocates nothing.
/// Not thread-safe; one per thread.
class StateHasher {
 public:
  StateHasher();
  StateHasher(StateHasher&&) noexcept;
  StateHasher& operator=(StateHasher&&) noexcept;
  StateHasher(const StateHasher&) = delete;
  StateHasher& operator=(const StateHasher&) = delete;
  ~StateHasher();

  /// Columns in this order, each over all slots: alive (u8), generation (u8), type (u16), p x, y, z, v x, y,
  /// z, c x, y, z (i32), then `codec_state`, the codec's per-body bytes (empty for the paper's codecs).
  [[nodiscard]] std::uint64_t hash(const State& state, std::span<const std::byte> codec_state = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// XXH3-64 of a byte range (layout hashes, tables).
[[nodiscard]] std::uint64_t hash_bytes(std::span<const std::byte> bytes);

/// 16 lower-case hex digits, as in hash logs.
[[nodiscard]] std::string to_hex(std::uint64_t hash);

}  // namespace tandem
