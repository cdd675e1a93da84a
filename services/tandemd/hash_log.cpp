#include "services/tandemd/hash_log.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

#include "sdk/core/lattice/hash.hpp"

namespace tandem::daemon {

Result<void> HashLog::open(const std::string& path, std::size_t streams) {
  for (std::size_t stream = 0; stream < streams && !path.empty(); ++stream) {
    paths_.push_back(stream == 0 ? path : fmt::format("{}.{}", path, stream));
    files_.emplace_back(std::fopen(paths_.back().c_str(), "a"));
    if (!files_.back())
      return fail(ErrorCode::kIo,
                  fmt::format("{}: cannot be written: {}", paths_.back(), std::strerror(errno)));
    // Line buffering leaves whole lines even if the server is killed.
    std::setvbuf(files_.back().get(), nullptr, _IOLBF, BUFSIZ);
  }
  return {};
}

void HashLog::add(std::uint32_t stream, Frame frame, std::uint64_t hash) {
  if (stream >= files_.size()) return;
  std::fputs(fmt::format("{},{},{}\n", epoch_, frame, to_hex(hash)).c_str(), files_[stream].get());
}

Result<void> HashLog::close() {
  Result<void> closed;
  for (std::size_t stream = 0; stream < files_.size(); ++stream) {
    const bool failed = std::ferror(files_[stream].get()) != 0;
    if (std::fclose(files_[stream].release()) != 0 || failed)
      closed = fail(ErrorCode::kIo, fmt::format("{}: not all hashes could be written", paths_[stream]));
  }
  files_.clear();
  return closed;
}

}  // namespace tandem::daemon
