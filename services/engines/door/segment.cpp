#include "services/engines/door/segment.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace tandem::engine::door {

Result<Segment> Segment::make(std::size_t bytes) {
  const auto refuse = [bytes] {
    return fail(ErrorCode::kIo, fmt::format("no {} bytes of shared memory for the engine's bodies: {}", bytes,
                                            std::strerror(errno)));
  };
  Segment segment;
  segment.descriptor_ = system::Descriptor(::memfd_create("tandem-door", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  const int fd = segment.descriptor_.get();
  if (fd < 0) return refuse();
  // Allocated now: a page that cannot be had later would end the process.
  if (const int why = ::posix_fallocate(fd, 0, static_cast<off_t>(bytes)); why != 0) {
    errno = why;
    return refuse();
  }
  if (::fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) return refuse();
  void* const at = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
  if (at == MAP_FAILED) return refuse();
  segment.bytes_ = {static_cast<std::byte*>(at), bytes};
  return segment;
}

Segment::Segment(Segment&& other) noexcept
    : descriptor_(std::move(other.descriptor_)), bytes_(std::exchange(other.bytes_, {})) {}

Segment& Segment::operator=(Segment&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(bytes_, other.bytes_);
  return *this;
}

Segment::~Segment() {
  if (!bytes_.empty()) ::munmap(bytes_.data(), bytes_.size());
}

std::string Segment::path() const { return fmt::format("/proc/{}/fd/{}", ::getpid(), descriptor_.get()); }

}  // namespace tandem::engine::door
