#pragma once
// Simulates a slow processor by a share of one of this machine's.

#include <sys/types.h>

#include <memory>
#include <string>

#include "tandem/result.hpp"

namespace tandem::lab {

/// Limits the processor time of processes, for all their threads together: by a control group (version 1 or
/// 2) if one can be made, else by stopping and continuing the process. Not thread-safe.
class ThinDevice {
 public:
  [[nodiscard]] static std::unique_ptr<ThinDevice> create();
  virtual ~ThinDevice() = default;
  ThinDevice(const ThinDevice&) = delete;
  ThinDevice& operator=(const ThinDevice&) = delete;

  [[nodiscard]] virtual std::string name() const = 0;
  /// For ChildPlace::cgroup_procs; empty: none.
  [[nodiscard]] virtual std::string procs() const = 0;
  /// Sets the share of one processor, in (0, 1], for programs that run now and later. Errors: kIo.
  virtual Result<void> set_share(double share) = 0;
  /// A process that was just started in procs(); it is forgotten by release().
  virtual void hold(pid_t process) = 0;
  virtual void release() = 0;

 protected:
  ThinDevice() = default;
};

}  // namespace tandem::lab
