#pragma once
// The state hash that every delta carries: XXH3-64, seed 0.

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "sdk/core/lattice/run_blocks.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// Columns in addition to the state's own: one byte per slot, one column after another. They are part of hash
/// and snapshot.
struct ExtraColumns {
  std::span<const std::byte> codec;
  std::span<const std::byte> predictor;
};

/// Hashes a state block by block, so that blocks can be hashed in parallel: idl/PROTOCOL.md, "State hash". It
/// keeps its working memory, so only a call for more blocks than ever before allocates. Not thread-safe.
class StateHasher {
 public:
  StateHasher();
  StateHasher(StateHasher&&) noexcept;
  StateHasher& operator=(StateHasher&&) noexcept;
  StateHasher(const StateHasher&) = delete;
  StateHasher& operator=(const StateHasher&) = delete;
  ~StateHasher();

  /// The hash of a state with one region. `run` changes no bit of the result.
  [[nodiscard]] std::uint64_t hash(const State& state, const ExtraColumns& extra = {},
                                   const RunBlocks& run = {});
  /// The hash of that region, from the last hash().
  [[nodiscard]] std::uint64_t region_hash() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The XXH3-64 of a byte range (layout hashes, tables).
[[nodiscard]] std::uint64_t hash_bytes(std::span<const std::byte> bytes);

/// 16 lower-case hex digits, as in hash logs.
[[nodiscard]] std::string to_hex(std::uint64_t hash);

}  // namespace tandem
