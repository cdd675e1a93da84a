#include "services/follow/audience/folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "services/follow/audience/object_name.hpp"
#include "services/program/system/file_lock.hpp"

namespace tandem::audience {
namespace {

namespace fs = std::filesystem;

Result<void> make_folder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path, error))
    return fail(ErrorCode::kIo,
                path + ": cannot make the folder: " + (error ? error.message() : "it is a file"));
  return {};
}

bool write_all(int file, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t taken = ::write(file, bytes.data(), bytes.size());
    if (taken < 0 && errno == EINTR) continue;
    if (taken <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(taken));
  }
  return true;
}

}  // namespace

Result<Folder> Folder::open(const std::string& path) {
  if (auto made = make_folder(path); !made) return tl::unexpected(made.error());
  system::Descriptor folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder.is_open()) return fail(ErrorCode::kIo, path + ": cannot open: " + std::strerror(errno));
  if (const auto holder = system::lock_or_holder(folder.get(), system::LockKind::kExclusive))
    return fail(ErrorCode::kConflict, path + ": " + *holder + " is writing there");
  if (auto made = make_folder(path + "/objects"); !made) return tl::unexpected(made.error());
  Folder out(path, std::move(folder));
  std::error_code error;
  for (fs::directory_iterator file(path + "/objects", error), end; !error && file != end;
       file.increment(error)) {
    const std::string name = file->path().filename().string();
    if (is_object_file(name)) out.leftovers_.insert("objects/" + name);
  }
  if (error) return fail(ErrorCode::kIo, path + "/objects: cannot read: " + error.message());
  return out;
}

tl::unexpected<Error> Folder::failure(const std::string& file, const char* what) const {
  return fail(ErrorCode::kIo, path_ + "/" + file + ": " + what + ": " + std::strerror(errno));
}

Result<void> Folder::put(const std::string& path, std::span<const std::byte> bytes) {
  const std::string part = path + ".part";
  system::Descriptor file(
      ::openat(folder_.get(), part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666));
  if (!file.is_open()) return failure(part, "cannot create");
  if (!write_all(file.get(), bytes) || !file.close()) {
    auto failed = failure(part, "cannot write");
    ::unlinkat(folder_.get(), part.c_str(), 0);
    return failed;
  }
  if (::renameat(folder_.get(), part.c_str(), folder_.get(), path.c_str()) != 0) {
    auto failed = failure(path, "cannot rename");
    ::unlinkat(folder_.get(), part.c_str(), 0);
    return failed;
  }
  leftovers_.erase(path);
  leftovers_.erase(part);
  return {};
}

Result<std::optional<std::string>> Folder::read(const std::string& path) const {
  system::Descriptor file(
      ::openat(folder_.get(), path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_NOFOLLOW | O_CLOEXEC));
  if (!file.is_open() && errno == ENOENT) return std::nullopt;
  if (!file.is_open()) return failure(path, "cannot read");
  struct stat about {};
  if (::fstat(file.get(), &about) != 0) return failure(path, "cannot read");
  if (!S_ISREG(about.st_mode) || static_cast<std::uint64_t>(about.st_size) > kMaxReadBytes)
    return fail(ErrorCode::kIo, path_ + "/" + path + ": is no file, or too large");
  std::string text(static_cast<std::size_t>(about.st_size), '\0');
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t taken = ::read(file.get(), &text[done], text.size() - done);
    if (taken < 0 && errno == EINTR) continue;
    if (taken <= 0) return failure(path, "cannot read");
    done += static_cast<std::size_t>(taken);
  }
  return text;
}

void Folder::remove(const std::string& path) { ::unlinkat(folder_.get(), path.c_str(), 0); }

void Folder::remove_leftovers() {
  for (const std::string& path : leftovers_) remove(path);
  leftovers_.clear();
}

Result<void> Folder::sync() {
  if (::syncfs(folder_.get()) != 0) return failure("", "cannot write");
  return {};
}

}  // namespace tandem::audience
