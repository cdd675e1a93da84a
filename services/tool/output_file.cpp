#include "services/tool/output_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace tandem::tool {

OutputFile::OutputFile(std::string path, std::FILE* file) : path_(std::move(path)), file_(file) {}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      unfinished_(std::exchange(other.unfinished_, false)),
      file_(std::move(other.file_)) {}

Result<OutputFile> OutputFile::create(std::string path) {
  std::FILE* file = std::fopen((path + ".part").c_str(), "wb");
  if (file == nullptr) return fail(ErrorCode::kIo, path + ": cannot create: " + std::strerror(errno));
  return OutputFile(std::move(path), file);
}

OutputFile::~OutputFile() {
  if (!unfinished_) return;
  file_.reset();
  std::remove(part().c_str());
}

tl::unexpected<Error> OutputFile::failure(const char* what) const {
  return fail(ErrorCode::kIo, path_ + ": " + what + ": " + std::strerror(errno));
}

Result<void> OutputFile::write(std::span<const std::byte> bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) return failure("cannot write");
  return {};
}

Result<void> OutputFile::rewrite_start(std::span<const std::byte> bytes) {
  if (std::fseek(file_.get(), 0, SEEK_SET) != 0) return failure("cannot write");
  return write(bytes);
}

Result<void> OutputFile::close() {
  if (file_ == nullptr) return {};
  // A full disk may show only here.
  if (std::fflush(file_.get()) != 0 || ::fsync(::fileno(file_.get())) != 0) return failure("cannot write");
  if (std::fclose(file_.release()) != 0) return failure("cannot write");
  return {};
}

Result<void> OutputFile::commit() {
  return close().and_then([this]() -> Result<void> {
    if (std::rename(part().c_str(), path_.c_str()) != 0) return failure("cannot rename");
    unfinished_ = false;
    return {};
  });
}

}  // namespace tandem::tool
