#pragma once
// The state hash that every delta carries: XXH3-64, seed 0.

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "sdk/core/lattice/block_ledger.hpp"
#include "sdk/core/lattice/run_blocks.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// Columns in addition to the state's own: one byte per slot, one column after another. They are part of hash
/// and snapshot.
struct ExtraColumns {
  std::span<const std::byte> codec;
  std::span<const std::byte> predictor;
};

/// The numbers of what a hasher reads: of the state with the predictor's columns, and of the codec's columns,
/// which need none if there are none. Numbers of several states, or of a codec after Codec::load(), must not
/// meet in one hasher unless equal ones mean equal columns.
struct HashedNumbers {
  BlockNumbers state;
  BlockNumbers codec;
};

/// Hashes a state block by block, so that blocks can be hashed in parallel: idl/PROTOCOL.md, "State hash". It
/// keeps the leaves, and computes anew only those of blocks whose numbers it does not know. It keeps its
/// working memory, so only a call for more blocks than ever before allocates. Not thread-safe.
class StateHasher {
 public:
  StateHasher();
  StateHasher(StateHasher&&) noexcept;
  StateHasher& operator=(StateHasher&&) noexcept;
  StateHasher(const StateHasher&) = delete;
  StateHasher& operator=(const StateHasher&) = delete;
  ~StateHasher();

  /// The hash of a state. `run` changes no bit of the result.
  [[nodiscard]] std::uint64_t hash(const State& state, const ExtraColumns& extra = {},
                                   const RunBlocks& run = {}, const HashedNumbers& numbers = {});
  /// The hash of all leaves, from the last hash().
  [[nodiscard]] std::uint64_t leaves_hash() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The XXH3-64 of a byte range (layout hashes, tables).
[[nodiscard]] std::uint64_t hash_bytes(std::span<const std::byte> bytes);

/// 16 lower-case hex digits, as in hash logs.
[[nodiscard]] std::string to_hex(std::uint64_t hash);

}  // namespace tandem
