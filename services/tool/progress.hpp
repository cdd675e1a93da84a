#pragma once
// Shows the progress of work that takes longer than two seconds, on a terminal only.

#include <cstdint>
#include <string>

namespace tandem::tool {

/// Rewrites one line on stderr a few times a second; removes it at the end. Silent when stderr is no
/// terminal.
class Progress {
 public:
  explicit Progress(std::string what, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void at(std::uint64_t done);

 private:
  std::string what_;
  std::uint64_t total_;
  bool terminal_;
  bool shown_ = false;
  std::int64_t next_ns_;
};

}  // namespace tandem::tool
