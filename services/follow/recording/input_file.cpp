#include "services/follow/recording/input_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::recording {
namespace {

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISFIFO(mode)) return "a FIFO";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

}  // namespace

std::span<std::byte> ReadBuffer::of(std::size_t size_bytes) {
  if (size_bytes > size_bytes_) {
    bytes_ = std::make_unique_for_overwrite<std::byte[]>(size_bytes);
    size_bytes_ = size_bytes;
  }
  return {bytes_.get(), size_bytes};
}

Result<InputFile> InputFile::open(const std::string& path) {
  const auto refuse = [&path](const std::string& why) {
    return fail(ErrorCode::kIo, path + ": cannot read: " + why);
  };
  const auto refuse_kind = [&](mode_t mode) {
    return refuse(std::string("it is ") + kind_of(mode) + ", and no regular file");
  };
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0) return refuse(std::strerror(errno));
  if (!S_ISREG(about.st_mode)) return refuse_kind(about.st_mode);
  // Another file may have its name by now. So the opening must not block, and its kind is checked again.
  InputFile file(system::Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)));
  if (!file.file_.is_open() || ::fstat(file.file_.get(), &about) != 0) return refuse(std::strerror(errno));
  if (!S_ISREG(about.st_mode)) return refuse_kind(about.st_mode);
  file.size_bytes_ = static_cast<std::uint64_t>(about.st_size);
  return file;
}

Result<std::span<const std::byte>> InputFile::read(std::uint64_t at, std::size_t count,
                                                   ReadBuffer& buffer) const {
  TANDEM_ASSERT(at <= size_bytes_ && count <= size_bytes_ - at);
  if (!file_.is_open()) return memory_.subspan(at, count);
  const std::span<std::byte> bytes = buffer.of(count);
  for (std::size_t done = 0; done < count;) {
    const ssize_t taken = ::pread(file_.get(), &bytes[done], count - done, static_cast<off_t>(at + done));
    if (taken < 0 && errno == EINTR) continue;
    if (taken < 0) return fail(ErrorCode::kIo, std::string("cannot read: ") + std::strerror(errno));
    if (taken == 0) return fail(ErrorCode::kIo, "it became shorter while it was read");
    done += static_cast<std::size_t>(taken);
  }
  return bytes;
}

}  // namespace tandem::recording
