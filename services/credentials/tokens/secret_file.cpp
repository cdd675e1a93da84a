#include "services/credentials/tokens/secret_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "services/program/system/descriptor.hpp"

namespace tandem::tokens {
namespace {

constexpr unsigned kEverybodyWrites = 0002, kEverybody = 0006, kAllButTheOwner = 0077;

Error io_error(const std::string& path, std::string_view what) {
  return {ErrorCode::kIo, fmt::format("{}: cannot be {}: {}", path, what, std::strerror(errno))};
}

Result<void> check_mode(const std::string& path, unsigned mode, Others others) {
  const auto refuse = [&](std::string_view who, std::string_view cure) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("{}: {} (mode {:04o}), so it is not used: chmod {} {}", path, who, mode & 07777U,
                            cure, path));
  };
  switch (others) {
    case Others::kAnything:
      break;
    case Others::kMayNotWrite:
      if ((mode & kEverybodyWrites) != 0) return refuse("everybody can write it", "644");
      break;
    case Others::kMayNotRead:
      if ((mode & kEverybody) != 0) return refuse("everybody can read or write this secret", "600");
      break;
    case Others::kNorTheirGroup:
      if ((mode & kAllButTheOwner) != 0)
        return refuse("others than its owner can read or write this secret", "600");
      break;
  }
  return {};
}

}  // namespace

Result<std::string> read_file(const std::string& path, Others others, std::size_t most_bytes) {
  // A FIFO must not make the program wait.
  const system::Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file.is_open()) return tl::unexpected(io_error(path, "opened"));
  struct stat info = {};
  if (fstat(file.get(), &info) != 0) return tl::unexpected(io_error(path, "read"));
  if (!S_ISREG(info.st_mode)) return fail(ErrorCode::kIo, fmt::format("{}: is no regular file", path));
  if (auto good = check_mode(path, info.st_mode, others); !good) return tl::unexpected(good.error());
  std::string content;
  std::array<char, 4096> piece{};
  while (true) {
    const ssize_t size = ::read(file.get(), piece.data(), piece.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return tl::unexpected(io_error(path, "read"));
    if (size == 0) return content;
    content.append(piece.data(), static_cast<std::size_t>(size));
    if (content.size() > most_bytes)
      return fail(ErrorCode::kCapacity, fmt::format("{}: larger than {} bytes", path, most_bytes));
  }
}

Result<void> write_new_file(const std::string& path, std::string_view content, unsigned mode) {
  system::Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (!file.is_open() && errno == EEXIST)
    return fail(ErrorCode::kConflict, fmt::format("{}: is there already, and stays as it is", path));
  if (!file.is_open()) return tl::unexpected(io_error(path, "made"));
  const ssize_t size = ::write(file.get(), content.data(), content.size());
  if (size == static_cast<ssize_t>(content.size()) && fchmod(file.get(), mode) == 0 &&
      fsync(file.get()) == 0 && file.close())
    return {};
  const Error error = io_error(path, "written");
  ::unlink(path.c_str());
  return tl::unexpected(error);
}

}  // namespace tandem::tokens
