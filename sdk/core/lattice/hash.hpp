#pragma once
// The state hash that every delta carries: XXH3-64, seed 0.

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "sdk/core/lattice/run_blocks.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// Columns beside the state's own: one byte a slot, one column after another. Part of hash and snapshot.
struct ExtraColumns {
  std::span<const std::byte> codec;
  std::span<const std::byte> predictor;
};

/// Hashes block by block, so that blocks can be hashed side by side: idl/PROTOCOL.md, "State hash". Keeps its
/// working memory, so only the first call for more blocks than ever before allocates. Not thread-safe.
class StateHasher {
 public:
  StateHasher();
  StateHasher(StateHasher&&) noexcept;
  StateHasher& operator=(StateHasher&&) noexcept;
  StateHasher(const StateHasher&) = delete;
  StateHasher& operator=(const StateHasher&) = delete;
  ~StateHasher();

  /// Of a state with one region. `run` changes no bit of the result.
  [[nodiscard]] std::uint64_t hash(const State& state, const ExtraColumns& extra = {},
                                   const RunBlocks& run = {});
  /// Of that region, as the last hash() found it.
  [[nodiscard]] std::uint64_t region_hash() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// XXH3-64 of a byte range (layout hashes, tables).
[[nodiscard]] std::uint64_t hash_bytes(std::span<const std::byte> bytes);

/// 16 lower-case hex digits, as in hash logs.
[[nodiscard]] std::string to_hex(std::uint64_t hash);

}  // namespace tandem
