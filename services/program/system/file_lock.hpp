#pragma once
// Locks that keep two processes from writing the same file.

#include <cstdint>
#include <optional>
#include <string>

namespace tandem::system {

enum class LockKind : std::uint8_t {
  kShared,    ///< excludes only exclusive ones
  kExclusive  ///< excludes all others
};

/// Locks an open file or folder (flock) without waiting. The lock belongs to the opened file and not to its
/// name, and lasts until every copy of the descriptor is closed. Returns who holds a lock that excludes this
/// one, in words: "process 4711", or "another process" where the system does not say, as with a process in
/// another container. Returns nothing if the file is locked now, or if its file system has no locks.
[[nodiscard]] std::optional<std::string> lock_or_holder(int descriptor, LockKind kind);

}  // namespace tandem::system
