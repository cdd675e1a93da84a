#include "services/follow/recording/output_file.hpp"

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

#include "sdk/core/lattice/assert.hpp"
#include "services/program/system/descriptor.hpp"
#include "services/program/system/file_lock.hpp"

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

// More files than that beside each other are no use to anybody, and each costs a look.
constexpr unsigned kMaxNumber = 9999;

/// world.mcap, world-2.mcap, world-3.mcap ...
std::string numbered(const std::string& path, unsigned number) {
  if (number == 1) return path;
  const fs::path whole(path);
  return (whole.parent_path() / whole.stem()).string() + '-' + std::to_string(number) +
         whole.extension().string();
}

/// An empty file, as mktemp makes it, has nothing to lose.
bool holds_something(const std::string& path) {
  struct stat about {};
  return ::stat(path.c_str(), &about) == 0 && (!S_ISREG(about.st_mode) || about.st_size > 0);
}

/// Renames without replacing a file that holds something; errno is EEXIST then.
int rename_beside(const char* from, const std::string& to) {
  if (::renameat2(AT_FDCWD, from, AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  // Some file systems do not know the flag.
  if (errno != EEXIST && errno != EINVAL && errno != ENOSYS) return -1;
  if (!holds_something(to)) return std::rename(from, to.c_str());
  errno = EEXIST;
  return -1;
}

Error told_by_system() { return {ErrorCode::kIo, std::string("cannot create: ") + std::strerror(errno)}; }

/// Makes the new file `path` and locks it. If there is a file that nobody writes, a killed run left it: it is
/// removed, and not written to, because it may have another name too.
Result<File> create_locked(const std::string& path) {
  constexpr int kMaxRetries = 100;  // each one only if another process creates or removes the file meanwhile
  for (int i = 0; i < kMaxRetries; ++i) {
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

Result<void> check_free(const std::string& path) {
  if (holds_something(path)) return fail(ErrorCode::kConflict, path + ": exists; --overwrite replaces it");
  return {};
}

OutputFile::OutputFile(std::string wanted, unsigned number, Existing existing, std::FILE* file)
    : wanted_(std::move(wanted)),
      path_(numbered(wanted_, number)),
      part_(path_ + ".part"),
      number_(number),
      existing_(existing),
      file_(file) {
  std::setvbuf(file, nullptr, _IONBF, 0);  // what was written can be read, and is counted as it is
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : wanted_(std::move(other.wanted_)),
      path_(std::move(other.path_)),
      part_(std::move(other.part_)),
      number_(other.number_),
      existing_(other.existing_),
      unnamed_(std::exchange(other.unnamed_, false)),
      written_bytes_(other.written_bytes_),
      file_(std::move(other.file_)) {}

Result<OutputFile> OutputFile::create(const std::string& path, Existing existing) {
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::kIo, path + ": cannot create: " + why);
  };
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::status_known(status)) return refuse(error.message());
  if (fs::exists(status) && !fs::is_regular_file(status)) return refuse("it exists and is no regular file");
  const std::string target = follow_links(path).string();
  for (unsigned number = 1; number <= kMaxNumber; ++number) {
    const std::string name = numbered(target, number);
    const auto told = [&](const Error& why) {
      return fail(why.code, (number == 1 ? path : name) + ": " + why.message);
    };
    const auto is_free = [&]() -> Result<bool> {
      if (const auto holder = writer_of(name)) return tl::unexpected(written_by(*holder));
      return existing == Existing::kReplaced || !holds_something(name);
    };
    auto free = is_free();
    if (!free) return told(free.error());
    if (!*free) continue;
    if (::access(name.c_str(), F_OK) == 0 && ::access(name.c_str(), W_OK) != 0)
      return refuse(std::strerror(errno));
    auto file = create_locked(name + ".part");
    if (!file) return told(file.error());
    OutputFile made(target, number, existing, file->release());
    // Who writes under the name has held this .part before, so that from now on no other gets there.
    free = is_free();
    if (!free) return told(free.error());
    if (*free) return made;
  }
  return refuse("there are " + std::to_string(kMaxNumber) + " files of that name already");
}

OutputFile::~OutputFile() { discard(); }

bool OutputFile::has_part() const { return file_ != nullptr && same_file(::fileno(file_.get()), part_); }

void OutputFile::discard() {
  if (!unnamed_) return;
  unnamed_ = false;
  if (has_part()) ::unlink(part_.c_str());
  file_.reset();
}

tl::unexpected<Error> OutputFile::failure(const char* what) const {
  return fail(ErrorCode::kIo, path_ + ": " + what + ": " + std::strerror(errno));
}

Result<void> OutputFile::write(std::span<const std::byte> bytes) {
  TANDEM_ASSERT(file_ != nullptr);
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
    return fail(ErrorCode::kIo, path_ + ": cannot rename: " + part_ + " is another file by now, or is gone");
  for (;; path_ = numbered(wanted_, ++number_)) {
    if (const auto holder = writer_of(path_))
      return fail(ErrorCode::kConflict, path_ + ": cannot rename: " + *holder + " is writing it");
    if ((existing_ == Existing::kReplaced ? std::rename(part_.c_str(), path_.c_str())
                                          : rename_beside(part_.c_str(), path_)) == 0)
      break;
    if (errno != EEXIST || number_ >= kMaxNumber) return failure("cannot rename");
  }
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
