#pragma once
// One folder of a file system, as little of it as checkpoints need, so that tests can put a simulated disk in
// its place.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::checkpoint {

/// Names are those of files in the folder. Errors are kIo with the system's words, unless a member says more.
/// Used by one thread at a time.
class Disk {
 public:
  virtual ~Disk() = default;

  /// The folder's name, for people.
  [[nodiscard]] virtual const std::string& name() const = 0;
  [[nodiscard]] virtual Result<std::vector<std::string>> list() = 0;
  /// Reads a whole file. Errors: also kCapacity for more than `most_bytes`, and nothing is read then.
  [[nodiscard]] virtual Result<std::vector<std::byte>> read(const std::string& file,
                                                            std::uint64_t most_bytes) = 0;
  /// Makes a file, or replaces what it holds. A loss of power may leave any part of it.
  [[nodiscard]] virtual Result<void> write(const std::string& file, std::span<const std::byte> bytes) = 0;
  /// The content of the file survives a loss of power.
  [[nodiscard]] virtual Result<void> sync(const std::string& file) = 0;
  /// Replaces `to` if it exists.
  [[nodiscard]] virtual Result<void> rename(const std::string& from, const std::string& to) = 0;
  [[nodiscard]] virtual Result<void> remove(const std::string& file) = 0;
  /// The names of files survive a loss of power.
  [[nodiscard]] virtual Result<void> sync_folder() = 0;
  /// Tries to mend a folder that is gone: makes it again. No effect if it is there.
  [[nodiscard]] virtual Result<void> reopen() = 0;
};

/// Opens a folder of the system and locks it for as long as the result lives. Makes the folder if it does not
/// exist; its parent must. A file system without locks excludes nobody. Errors: kIo; kConflict: another
/// process holds the folder, and the message names it where the system tells.
[[nodiscard]] Result<std::unique_ptr<Disk>> open_folder(const std::string& path);

/// What open_folder() says of the folder, without making or locking it. Errors: kIo.
[[nodiscard]] Result<void> check_folder(const std::string& path);

/// Reads a file anywhere. Errors: as Disk::read().
[[nodiscard]] Result<std::vector<std::byte>> read_file(const std::string& path, std::uint64_t most_bytes);

}  // namespace tandem::checkpoint
