#include "services/recording/output_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

namespace tandem::recording {
namespace {

namespace fs = std::filesystem;

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
  const std::string part = target + ".part";
  ::unlink(part.c_str());  // of a run that was killed
  std::FILE* file = std::fopen(part.c_str(), "wbx");
  if (file == nullptr) return refuse(std::strerror(errno));
  return OutputFile(std::move(target), file);
}

OutputFile::~OutputFile() {
  if (!unnamed_) return;
  file_.reset();
  std::remove(part().c_str());
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
  if (std::rename(part().c_str(), path_.c_str()) != 0) return failure("cannot rename");
  unnamed_ = false;
  return {};
}

Result<void> OutputFile::close() {
  if (file_ == nullptr) return {};
  // A full disk may show only here.
  if (std::fflush(file_.get()) != 0 || ::fsync(::fileno(file_.get())) != 0) return failure("cannot write");
  if (std::fclose(file_.release()) != 0) return failure("cannot write");
  return {};
}

Result<void> OutputFile::commit() {
  return close().and_then([this] { return take_name(); });
}

Result<void> check_distinct(const std::string& input, const std::string& output) {
  for (const std::string& written : {output, output + ".part"}) {
    std::error_code error;  // one that is not there is another
    if (fs::equivalent(input, written, error))
      return fail(ErrorCode::kInvalidArgument, written + ": is the recording that is read");
  }
  return {};
}

}  // namespace tandem::recording
