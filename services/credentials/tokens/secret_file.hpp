#pragma once
// Files of keys: read with a look at who else may read or write them, written so that nobody else can.

#include <cstdint>
#include <string>
#include <string_view>

#include "tandem/result.hpp"

namespace tandem::tokens {

/// Who besides the owner may do something with a file.
enum class Others : std::uint8_t {
  kAnything,      ///< no look at the file's mode
  kMayNotWrite,   ///< refused if everybody can write it, as who writes a public key lets himself in
  kMayNotRead,    ///< refused if everybody can read or write it; a group may
  kNorTheirGroup  ///< refused if anybody but the owner can read or write it
};

inline constexpr std::size_t kMaxFileBytes = 64U << 10U;

/// A regular file's content. Errors: kIo, kCapacity (above `most_bytes`), kInvalidArgument (others may do
/// what `others` forbids); the message names file and cure.
[[nodiscard]] Result<std::string> read_file(const std::string& path, Others others,
                                            std::size_t most_bytes = kMaxFileBytes);

/// Makes a new file with exactly this mode. Errors: kConflict (there is one already), kIo.
[[nodiscard]] Result<void> write_new_file(const std::string& path, std::string_view content, unsigned mode);

}  // namespace tandem::tokens
