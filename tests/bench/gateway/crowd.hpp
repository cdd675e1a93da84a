#pragma once
// Many viewers in one thread, which read only frame numbers.

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "sdk/core/lattice/state.hpp"

namespace tandem::bench {

class Crowd {
 public:
  /// When a viewer had a frame, by the steady clock. In the kernel: as if each viewer were on a machine of
  /// its own. Read: after the others before it, as all share a thread here.
  struct Arrival {
    std::int64_t in_kernel_ns = 0, read_ns = 0;
  };

  /// `sleepers` of them read nothing any more once they play.
  Crowd(int port, std::size_t viewers, std::size_t sleepers);
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;
  Crowd(Crowd&&) = delete;
  Crowd& operator=(Crowd&&) = delete;
  ~Crowd();

  /// Serves the connections for a while.
  void run_for(std::int64_t ns);
  [[nodiscard]] std::size_t playing() const;
  /// Frames that did not follow the one before, and connections that ended.
  [[nodiscard]] std::uint64_t gaps() const;
  [[nodiscard]] std::uint64_t lost() const;
  /// Of each of the viewers that read, by frame.
  [[nodiscard]] const std::map<Frame, std::vector<Arrival>>& arrivals() const;
  void forget_arrivals();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::bench
