#pragma once
// A file in memory with a fuzzer's bytes in it, for parsers that take a path.

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>

namespace tandem::fuzz {

/// A folder of this process in shared memory, removed at its end.
class ScratchFolder {
 public:
  ScratchFolder() : path_("/dev/shm/tandem-fuzz-" + std::to_string(getpid())) {
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ScratchFolder(ScratchFolder&&) = delete;
  ScratchFolder& operator=(ScratchFolder&&) = delete;

  /// Replaces the content of a file; returns its path.
  [[nodiscard]] std::string put(const std::string& name, std::span<const std::uint8_t> content) const {
    std::string path = path_ + "/" + name;
    const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (file < 0 || write(file, content.data(), content.size()) != static_cast<ssize_t>(content.size()))
      std::abort();
    close(file);
    return path;
  }

 private:
  std::string path_;
};

}  // namespace tandem::fuzz
