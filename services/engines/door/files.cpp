#include "services/engines/door/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "services/engines/door/channel.hpp"
#include "services/engines/door/wire.hpp"
#include "services/program/system/descriptor.hpp"

namespace tandem::engine::door {

Folder::~Folder() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

Result<std::string> Folder::file(const std::string& name) {
  if (path_.empty()) {
    std::error_code why;
    constexpr std::size_t kMaxNameBytes = 8;
    std::string path = (std::filesystem::temp_directory_path(why) / "tandem-door-XXXXXX").string();
    // TMPDIR may be too long for the socket.
    if (path.size() + kMaxNameBytes > kMaxPathBytes) path = "/tmp/tandem-door-XXXXXX";
    if (why || ::mkdtemp(path.data()) == nullptr)
      return fail(ErrorCode::kIo, fmt::format("{}: no folder can be made there", path));
    path_ = path;
  }
  return path_ + "/" + name;
}

bool write_file(const std::string& path, std::span<const std::byte> bytes) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(bytes.data()),  // NOLINT: as write() wants it
            static_cast<std::streamsize>(bytes.size()));
  return static_cast<bool>(out.flush());
}

Result<void> append_saved(const std::string& path, std::uint64_t bytes, std::vector<std::byte>& out) {
  if (bytes > kMaxSavedBytes)
    return fail(ErrorCode::kMalformed, fmt::format("more than the {} that are allowed", kMaxSavedBytes));
  // Without waiting: a pipe would have the server wait for a writer.
  const system::Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC));
  struct stat there {};
  if (!file.is_open() || ::fstat(file.get(), &there) != 0 || !S_ISREG(there.st_mode))
    return fail(ErrorCode::kMalformed, "but there is no file");
  if (static_cast<std::uint64_t>(there.st_size) != bytes)
    return fail(ErrorCode::kMalformed, fmt::format("but there are {}", there.st_size));
  const std::size_t begin = out.size();
  out.resize(begin + bytes);
  for (std::size_t held = 0; held < bytes;) {
    const ssize_t got = ::read(file.get(), out.data() + begin + held, bytes - held);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return fail(ErrorCode::kIo, "but the file cannot be read whole");
    held += static_cast<std::size_t>(got);
  }
  return {};
}

void remove_file(const std::string& path) {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
}

}  // namespace tandem::engine::door
