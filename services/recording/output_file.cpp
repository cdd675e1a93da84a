#include "services/recording/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "services/system/descriptor.hpp"
#include "services/system/file_lock.hpp"

namespace tandem::recording {
namespace {

namespace fs = std::filesystem;
using system::Descriptor;

// The end of a chain of links, whether a file exists there or not. There is no cycle, because the caller has
// asked for the status.
fs::path follow_links(fs::path path) {
  std::error_code error;
  while (fs::is_symlink(path, error)) {
    const fs::path target = fs::read_symlink(path, error);
    if (error) break;
    path = path.parent_path() / target;
  }
  return path;
}

struct Closer {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Closer>;

bool same_file(int descriptor, const std::string& path) {
  struct stat held {};
  struct stat named {};
  return ::fstat(descriptor, &held) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         held.st_dev == named.st_dev && held.st_ino == named.st_ino;
}

/// Names the process that writes the file `path`, if there is one.
std::optional<std::string> writer_of(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (!file.is_open()) return std::nullopt;
  return system::lock_or_holder(file.get(), system::LockKind::kShared);
}

Error written_by(const std::string& holder) {
  return {ErrorCode::kConflict, "cannot create: " + holder + " is writing it"};
}

Error told_by_system() { return {ErrorCode::kIo, std::string("cannot create: ") + std::strerror(errno)}; }

/// Makes the new file `path` and locks it. If there is a file that nobody writes, a killed run left it: it is
/// removed, and not written to, because it may have another name too.
Result<File> create_locked(const std::string& path) {
  constexpr int kMostRetries = 100;  // each one only if another process creates or removes the file meanwhile
  for (int i = 0; i < kMostRetries; ++i) {
    Descriptor opened(
        ::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0666));
    if (!opened.is_open()) return tl::unexpected(told_by_system());
    File file(::fdopen(opened.get(), "r+b"));
    if (file == nullptr) return tl::unexpected(told_by_system());
    const int descriptor = opened.release();  // of the FILE now
    struct stat about {};
    if (::fstat(descriptor, &about) != 0) return tl::unexpected(told_by_system());
    if (!S_ISREG(about.st_mode))
      return fail(ErrorCode::kIo, "cannot create: " + path + " exists and is no regular file");
    if (const auto holder = system::lock_or_holder(descriptor, system::LockKind::kExclusive))
      return tl::unexpected(written_by(*holder));
    if (!same_file(descriptor, path)) continue;  // its writer has renamed or removed it meanwhile
    if (about.st_size == 0 && about.st_nlink == 1) return file;
    ::unlink(path.c_str());
  }
  return tl::unexpected(written_by("another process"));
}

}  // namespace

OutputFile::OutputFile(std::string path, std::FILE* file) : path_(std::move(path)), file_(file) {
  std::setvbuf(file, nullptr, _IONBF, 0);  // what was written can be read, and is counted as it is
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      unnamed_(std::exchange(other.unnamed_, false)),
      written_bytes_(other.written_bytes_),
      file_(std::move(other.file_)) {}

Result<OutputFile> OutputFile::create(const std::string& path) {
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::kIo, path + ": cannot create: " + why);
  };
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::status_known(status)) return refuse(error.message());
  if (fs::exists(status)) {
    if (!fs::is_regular_file(status)) return refuse("it exists and is no regular file");
    if (::access(path.c_str(), W_OK) != 0) return refuse(std::strerror(errno));
  }
  std::string target = follow_links(path).string();
  auto file = create_locked(target + ".part");
  if (!file) return fail(file.error().code, path + ": " + file.error().message);
  OutputFile made(std::move(target), file->release());
  // A process that writes under the name has held this .part before, so from now on no other gets there.
  if (const auto holder = writer_of(made.path_)) {
    const Error written = written_by(*holder);
    return fail(written.code, path + ": " + written.message);
  }
  return made;
}

OutputFile::~OutputFile() { discard(); }

bool OutputFile::has_part() const { return file_ != nullptr && same_file(::fileno(file_.get()), part()); }

void OutputFile::discard() {
  if (!unnamed_) return;
  unnamed_ = false;
  if (has_part()) ::unlink(part().c_str());
  file_.reset();
}

tl::unexpected<Error> OutputFile::failure(const char* what) const {
  return fail(ErrorCode::kIo, path_ + ": " + what + ": " + std::strerror(errno));
}

Result<void> OutputFile::write(std::span<const std::byte> bytes) {
  const std::size_t taken = std::fwrite(bytes.data(), 1, bytes.size(), file_.get());
  written_bytes_ += taken;
  if (taken != bytes.size()) return failure("cannot write");
  return {};
}

Result<void> OutputFile::rewrite_start(std::span<const std::byte> bytes) {
  if (std::fseek(file_.get(), 0, SEEK_SET) != 0) return failure("cannot write");
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) return failure("cannot write");
  return {};
}

Result<void> OutputFile::take_name() {
  if (!unnamed_) return {};
  if (!has_part())
    return fail(ErrorCode::kIo, path_ + ": cannot rename: " + part() + " is another file by now, or is gone");
  if (const auto holder = writer_of(path_))
    return fail(ErrorCode::kConflict, path_ + ": cannot rename: " + *holder + " is writing it");
  if (std::rename(part().c_str(), path_.c_str()) != 0) return failure("cannot rename");
  unnamed_ = false;
  return {};
}

Result<void> OutputFile::sync() {
  // A full disk may show only here.
  if (std::fflush(file_.get()) != 0 || ::fsync(::fileno(file_.get())) != 0) return failure("cannot write");
  struct stat about {};
  if (::fstat(::fileno(file_.get()), &about) == 0 && about.st_nlink == 0)
    return fail(ErrorCode::kIo, path_ + ": was removed while it was written");
  return {};
}

Result<void> OutputFile::close() {
  if (file_ == nullptr) return {};
  if (auto synced = sync(); !synced) return synced;
  if (std::fclose(file_.release()) != 0) return failure("cannot write");
  return {};
}

Result<void> OutputFile::commit() {
  if (file_ == nullptr) return {};
  return sync().and_then([this] { return take_name(); }).and_then([this] { return close(); });
}

Result<void> check_distinct(const std::string& input, const std::string& output) {
  for (const std::string& written : {output, output + ".part"}) {
    std::error_code error;  // a file that is missing is another one
    if (fs::equivalent(input, written, error))
      return fail(ErrorCode::kInvalidArgument, written + ": is the recording that is read");
  }
  return {};
}

}  // namespace tandem::recording
