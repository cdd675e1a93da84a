#pragma once
// The hashes of a server's frames: --hash-log.

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "sdk/core/lattice/state.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// Adds lines `epoch,frame,hash` to a file for each stream; those of an earlier run stay.
class HashLog {
 public:
  /// `path` for stream 0, `path`.k for stream k. Errors: kIo.
  [[nodiscard]] Result<void> open(const std::string& path, std::size_t streams);
  /// The epoch of all lines.
  void begin(Epoch epoch) { epoch_ = epoch; }
  void add(std::uint32_t stream, Frame frame, std::uint64_t hash);
  /// Reports any write that failed, such as on a full disk.
  [[nodiscard]] Result<void> close();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::vector<std::unique_ptr<std::FILE, Close>> files_;
  std::vector<std::string> paths_;
  Epoch epoch_ = 0;
};

}  // namespace tandem::daemon
