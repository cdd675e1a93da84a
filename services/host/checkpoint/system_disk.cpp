// A folder of a POSIX system.

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <new>
#include <utility>

#include "services/host/checkpoint/disk.hpp"
#include "services/program/system/descriptor.hpp"
#include "services/program/system/file_lock.hpp"

namespace tandem::checkpoint {
namespace {

using system::Descriptor;

tl::unexpected<Error> told_by_system(const std::string& what) {
  return fail(ErrorCode::kIo, what + ": " + std::strerror(errno));
}

Result<std::vector<std::byte>> read_at(int folder, const std::string& path, std::uint64_t most_bytes) {
  // A FIFO in place of a file must not block.
  const Descriptor file(::openat(folder, path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (!file.is_open()) return told_by_system("cannot be opened");
  struct stat about {};
  if (::fstat(file.get(), &about) != 0) return told_by_system("cannot be read");
  if (!S_ISREG(about.st_mode)) return fail(ErrorCode::kIo, "is no regular file");
  const auto size = static_cast<std::uint64_t>(about.st_size);
  if (size > most_bytes) {
    return fail(ErrorCode::kCapacity, "has " + std::to_string(size) + " bytes, more than the maximum of " +
                                          std::to_string(most_bytes));
  }
  std::vector<std::byte> bytes;
  try {
    bytes.resize(static_cast<std::size_t>(size));
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kCapacity,
                "has " + std::to_string(size) + " bytes, more than there is memory for");
  }
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::read(file.get(), bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return told_by_system("cannot be read");
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  bytes.resize(done);  // it became shorter meanwhile
  return bytes;
}

class SystemDisk final : public Disk {
 public:
  explicit SystemDisk(std::string path) : path_(std::move(path)) {}

  Result<void> open() {
    if (::mkdir(path_.c_str(), 0777) != 0 && errno != EEXIST) return told_by_system("cannot be made");
    Descriptor folder(::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!folder.is_open()) return told_by_system("cannot be opened");
    // The folder itself is locked, so that a read-only one can be, too.
    if (const auto holder = system::lock_or_holder(folder.get(), system::LockKind::kExclusive))
      return fail(ErrorCode::kConflict, *holder + " keeps its checkpoints there");
    folder_ = std::move(folder);
    return {};
  }

  [[nodiscard]] const std::string& name() const override { return path_; }

  [[nodiscard]] Result<std::vector<std::string>> list() override {
    // fdopendir() takes over the descriptor, and reads from where another one of it stopped.
    const int again = ::openat(folder_.get(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR* const entries = again < 0 ? nullptr : ::fdopendir(again);
    if (entries == nullptr) return told_by_system("cannot be listed");
    std::vector<std::string> names;
    while (const dirent* entry = ::readdir(entries)) names.emplace_back(entry->d_name);
    ::closedir(entries);
    return names;
  }

  [[nodiscard]] Result<std::vector<std::byte>> read(const std::string& file,
                                                    std::uint64_t most_bytes) override {
    return read_at(folder_.get(), file, most_bytes);
  }

  [[nodiscard]] Result<void> write(const std::string& file, std::span<const std::byte> bytes) override {
    // What a killed run left is removed, and not written to: it may have another name too.
    ::unlinkat(folder_.get(), file.c_str(), 0);
    Descriptor made(
        ::openat(folder_.get(), file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
    if (!made.is_open()) return told_by_system("cannot be made");
    while (!bytes.empty()) {
      const ssize_t taken = ::write(made.get(), bytes.data(), bytes.size());
      if (taken < 0 && errno == EINTR) continue;
      if (taken < 0) return told_by_system("cannot be written");
      bytes = bytes.subspan(static_cast<std::size_t>(taken));
    }
    if (!made.close()) return told_by_system("cannot be written");
    return {};
  }

  [[nodiscard]] Result<void> sync(const std::string& file) override {
    const Descriptor opened(::openat(folder_.get(), file.c_str(), O_RDONLY | O_CLOEXEC));
    if (!opened.is_open() || ::fsync(opened.get()) != 0)
      return told_by_system("cannot be written to the disk");
    return {};
  }

  [[nodiscard]] Result<void> rename(const std::string& from, const std::string& to) override {
    if (::renameat(folder_.get(), from.c_str(), folder_.get(), to.c_str()) != 0)
      return told_by_system("cannot be renamed");
    return {};
  }

  [[nodiscard]] Result<void> remove(const std::string& file) override {
    if (::unlinkat(folder_.get(), file.c_str(), 0) != 0) return told_by_system("cannot be removed");
    return {};
  }

  [[nodiscard]] Result<void> sync_folder() override {
    if (::fsync(folder_.get()) != 0) return told_by_system("cannot be written to the disk");
    return {};
  }

  [[nodiscard]] Result<void> reopen() override {
    struct stat held {};
    struct stat named {};
    const bool same = ::fstat(folder_.get(), &held) == 0 && ::stat(path_.c_str(), &named) == 0 &&
                      held.st_dev == named.st_dev && held.st_ino == named.st_ino;
    return same ? Result<void>() : open();
  }

 private:
  std::string path_;
  Descriptor folder_;  // keeps the lock
};

}  // namespace

Result<void> check_folder(const std::string& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) == 0) {
    const Descriptor folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    return folder.is_open() ? Result<void>() : told_by_system(path + ": cannot be opened");
  }
  const std::string parent = std::filesystem::path(path).parent_path().string();
  if (errno != ENOENT || ::access(parent.empty() ? "." : parent.c_str(), W_OK | X_OK) != 0)
    return told_by_system(path + ": cannot be made");
  return {};
}

Result<std::unique_ptr<Disk>> open_folder(const std::string& path) {
  if (auto good = check_folder(path); !good) return tl::unexpected(good.error());
  auto disk = std::make_unique<SystemDisk>(path);
  if (auto opened = disk->open(); !opened)
    return fail(opened.error().code, path + ": " + opened.error().message);
  return std::unique_ptr<Disk>(std::move(disk));
}

Result<std::vector<std::byte>> read_file(const std::string& path, std::uint64_t most_bytes) {
  return read_at(AT_FDCWD, path, most_bytes);
}

}  // namespace tandem::checkpoint
