#include "services/recording/mapped_file.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace tandem::recording {

Result<MappedFile> MappedFile::open(const std::string& path) {
  const auto refuse = [&path](int reason) {
    return fail(ErrorCode::kIo, path + ": cannot read: " + std::strerror(reason));
  };
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return refuse(errno);
  struct stat about {};
  int reason = ::fstat(file, &about) == 0 ? 0 : errno;
  if (reason == 0 && !S_ISREG(about.st_mode)) reason = S_ISDIR(about.st_mode) ? EISDIR : EINVAL;
  const auto size = static_cast<std::size_t>(about.st_size);
  void* at = nullptr;
  if (reason == 0 && size > 0) {
    at = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
    if (at == MAP_FAILED) reason = errno;
  }
  ::close(file);
  if (reason != 0) return refuse(reason);
  return MappedFile({static_cast<const std::byte*>(at), size});
}

MappedFile::MappedFile(MappedFile&& other) noexcept : bytes_(std::exchange(other.bytes_, {})) {}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

}  // namespace tandem::recording
