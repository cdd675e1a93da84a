#pragma once
// The options of tandemd, checked and complete.

#include <cstdint>
#include <optional>
#include <string>

#include "services/sessions/session_plan.hpp"

namespace tandem::daemon {

struct Options : planning::ServiceWishes {
  std::string scene;               ///< name or file
  sessions::SessionChoice choice;  ///< its bodies and threads are the full simulation's, too
  std::uint64_t seed = 1;
  bool scripted = false;    ///< the server itself sends what the scene's users would
  std::uint32_t users = 0;  ///< of that script; 0: as many as the scene says

  std::uint32_t domain = 0;
  std::optional<double> duration_s;  ///< empty: until stopped

  std::string hash_log;  ///< path; empty: none
  bool json = false;     ///< a report on stdout at the end
};

}  // namespace tandem::daemon
