#pragma once
// The bytes of a file that is read, on the disk or in memory.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "services/program/system/descriptor.hpp"
#include "tandem/result.hpp"

namespace tandem::recording {

/// Memory that is kept from one read to the next. It grows and is never cleared.
class ReadBuffer {
 public:
  [[nodiscard]] std::span<std::byte> of(std::size_t size_bytes);

 private:
  std::unique_ptr<std::byte[]> bytes_;
  std::size_t size_bytes_ = 0;
};

/// Reads a file by system calls and not by a mapping: if another program cut a mapped file shorter, SIGBUS
/// would end the process. The length is the one that the file has when it is opened. Not thread-safe.
class InputFile {
 public:
  /// Opens a regular file. It refuses everything else without opening it, because a FIFO would block and a
  /// device may act. Errors: kIo, naming the file and the reason.
  static Result<InputFile> open(const std::string& path);
  /// Makes a file of bytes that outlive it.
  explicit InputFile(std::span<const std::byte> bytes) : memory_(bytes), size_bytes_(bytes.size()) {}

  [[nodiscard]] std::uint64_t size_bytes() const { return size_bytes_; }
  /// Returns `count` bytes from `at` on, all within size_bytes(). They stand in `buffer` or in memory that
  /// outlives the file, and are valid until the buffer's next use. Errors: kIo, without the file's name; also
  /// if the file became shorter.
  [[nodiscard]] Result<std::span<const std::byte>> read(std::uint64_t at, std::size_t count,
                                                        ReadBuffer& buffer) const;

 private:
  explicit InputFile(system::Descriptor file) : file_(std::move(file)) {}
  system::Descriptor file_;  // none: in memory
  std::span<const std::byte> memory_;
  std::uint64_t size_bytes_ = 0;
};

}  // namespace tandem::recording
