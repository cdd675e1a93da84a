#pragma once
// The files by which an engine of this machine saves and loads.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::engine::door {

/// A folder of this user alone, for a socket and for checkpoints; removed at the end. Not thread-safe.
class Folder {
 public:
  Folder() = default;
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  Folder(Folder&&) = delete;
  Folder& operator=(Folder&&) = delete;

  /// The path of a file in it; the first call makes the folder. Errors: kIo.
  Result<std::string> file(const std::string& name);

 private:
  std::string path_;
};

/// Writes a file anew. False: it could not be written whole.
[[nodiscard]] bool write_file(const std::string& path, std::span<const std::byte> bytes);

/// Appends what an engine saved. It says that there are `bytes`, which is not trusted. Errors: kMalformed (it
/// is no file, or has another size, or more than kMaxSavedBytes), kIo.
[[nodiscard]] Result<void> append_saved(const std::string& path, std::uint64_t bytes,
                                        std::vector<std::byte>& out);

void remove_file(const std::string& path);

}  // namespace tandem::engine::door
