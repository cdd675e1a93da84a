#pragma once
// The options of tandemd, checked and complete.

#include <cstdint>
#include <optional>
#include <string>

#include "services/checkpoint/keeper.hpp"
#include "services/metrics/address.hpp"
#include "services/sessions/session_plan.hpp"
#include "services/tandemd/places.hpp"

namespace tandem::daemon {

inline constexpr std::uint32_t kMostRank = 1000;

struct Options : planning::ServiceWishes {
  std::string scene;               ///< name or file
  sessions::SessionChoice choice;  ///< its bodies and threads also apply to the full simulation
  std::uint64_t seed = 1;
  bool scripted = false;    ///< run the scene's script in the server
  std::uint32_t users = 0;  ///< users of that script; 0: the scene's number

  std::uint32_t domain = 0;
  std::optional<double> duration_s;  ///< empty: until stopped

  checkpoint::Settings checkpoint;
  bool standby = false;            ///< stand by for the session's live server
  std::uint32_t standby_rank = 1;  ///< 1 .. kMostRank

  std::string hash_log;  ///< path; empty: none
  bool json = false;     ///< a report on stdout at the end

  std::optional<metrics::Address> metrics;  ///< empty: none are served

  Places places;  ///< of what comes from a file, for errors
};

}  // namespace tandem::daemon
