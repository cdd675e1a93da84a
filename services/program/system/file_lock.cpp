#include "services/program/system/file_lock.hpp"

#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <sstream>

namespace tandem::system {
namespace {

std::string holder_of(int descriptor) {
  struct stat about {};
  if (::fstat(descriptor, &about) != 0) return "another process";
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    // "1: FLOCK ADVISORY WRITE 4711 fd:00:1234 0 EOF", the inode in decimal
    std::istringstream fields(line);
    std::string number, type, mode, access, pid, place;
    fields >> number >> type >> mode >> access >> pid >> place;
    const std::size_t inode = place.rfind(':') + 1;
    if (type == "FLOCK" && access == "WRITE" && place.substr(inode) == std::to_string(about.st_ino) &&
        std::strtol(pid.c_str(), nullptr, 10) > 0)
      return "process " + pid;
  }
  return "another process";
}

}  // namespace

std::optional<std::string> lock_or_holder(int descriptor, LockKind kind) {
  const int operation = kind == LockKind::kShared ? LOCK_SH : LOCK_EX;
  if (::flock(descriptor, operation | LOCK_NB) == 0 || errno != EWOULDBLOCK) return std::nullopt;
  return holder_of(descriptor);
}

}  // namespace tandem::system
