#pragma once
// A file that appears under its name only when it is complete.

#include <cstddef>
#include <cstdio>
#include <memory>
#include <span>
#include <string>

#include "tandem/result.hpp"

namespace tandem::tool {

/// Writes to `path`.part and renames it on commit(). Without a commit() nothing is left behind.
class OutputFile {
 public:
  /// Errors: kIo, naming the file and the system's reason.
  static Result<OutputFile> create(std::string path);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  /// Errors: kIo, as when the disk is full.
  Result<void> write(std::span<const std::byte> bytes);
  /// Overwrites bytes at the start, as for a header that is known only afterwards.
  Result<void> rewrite_start(std::span<const std::byte> bytes);
  /// Everything is on the disk, still under the temporary name.
  Result<void> close();
  /// close(), then the file takes its name.
  Result<void> commit();
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  OutputFile(std::string path, std::FILE* file);
  [[nodiscard]] tl::unexpected<Error> failure(const char* what) const;
  [[nodiscard]] std::string part() const { return path_ + ".part"; }

  std::string path_;
  bool unfinished_ = true;  // the temporary file is there and ours to remove
  std::unique_ptr<std::FILE, Closer> file_;
};

}  // namespace tandem::tool
