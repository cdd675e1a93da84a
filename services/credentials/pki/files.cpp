#include "services/credentials/pki/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "services/program/system/descriptor.hpp"

namespace tandem::pki {
namespace {

tl::unexpected<Error> failed(const std::string& path, const char* what) {
  return fail(ErrorCode::kIo, path + ": cannot be " + what + ": " + std::strerror(errno));
}

bool write_all(int to, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t taken = ::write(to, text.data() + done, text.size() - done);
    if (taken < 0 && errno == EINTR) continue;
    if (taken < 0) return false;
    done += static_cast<std::size_t>(taken);
  }
  return true;
}

}  // namespace

Result<void> write_file(const std::string& path, const std::string& text, Readers readers) {
  const std::string part = path + ".part";
  ::unlink(part.c_str());  // what a killed run left
  const auto mode = static_cast<mode_t>(readers);
  system::Descriptor made(::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!made.is_open()) return failed(part, "made");
  const bool good =
      write_all(made.get(), text) && ::fchmod(made.get(), mode) == 0 && ::fsync(made.get()) == 0;
  if (!good || !made.close() || std::rename(part.c_str(), path.c_str()) != 0) {
    const auto error = failed(path, "written");
    ::unlink(part.c_str());
    return error;
  }
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const system::Descriptor parent(
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (parent.is_open()) ::fsync(parent.get());
  return {};
}

Result<void> write_files(const std::string& folder, const std::vector<File>& files) {
  Result<void> written;
  for (const File& file : files) {
    if (written) written = write_file(folder + "/" + file.name, file.text, file.readers);
  }
  return written;
}

Result<void> make_folder(const std::string& path) {
  if (::mkdir(path.c_str(), 0700) == 0) return {};
  if (errno != EEXIST) return failed(path, "made");
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0) return failed(path, "used");
  if (!S_ISDIR(about.st_mode)) return fail(ErrorCode::kIo, path + ": is no folder");
  if ((about.st_mode & 02U) == 0) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("{} can be changed by everybody (mode {:04o}): chmod 700 {}", path,
                          about.st_mode & 07777U, path));
}

}  // namespace tandem::pki
