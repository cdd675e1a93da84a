#pragma once
// A file's bytes as they are on the disk.

#include <cstddef>
#include <span>
#include <string>

#include "tandem/result.hpp"

namespace tandem::recording {

/// Maps a file for reading, at the length that it has now.
class MappedFile {
 public:
  /// Errors: kIo, naming the file and the system's reason.
  static Result<MappedFile> open(const std::string& path);
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&&) = delete;
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  ~MappedFile();

  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }

 private:
  explicit MappedFile(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::span<const std::byte> bytes_;
};

}  // namespace tandem::recording
