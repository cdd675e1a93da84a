#pragma once
// The options of tandemd, checked and complete.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "services/engines/door/door.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/host/checkpoint/keeper.hpp"
#include "services/program/configuration/places.hpp"
#include "services/program/logging/log.hpp"
#include "services/program/metrics/address.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// What a configuration file says that was changed while the server runs, by names of fields; and the values
/// that hold from now on.
struct Changes {
  std::vector<std::string> live, after_restart;
  std::uint32_t client_limit = 0;
  std::optional<double> stall_timeout_s;
  double checkpoint_interval_s = 0;
};

struct DaemonOptions : planning::ServiceWishes {
  std::string scene;                        ///< name or file; empty with an engine in another process
  std::optional<engine::door::Way> engine;  ///< how an engine in another process comes
  sessions::SessionChoice choice;           ///< its bodies and threads also apply to the full simulation
  std::uint64_t seed = 1;
  bool pipeline = true;     ///< HostConfig::pipeline
  bool scripted = false;    ///< run the scene's script in the server
  std::uint32_t users = 0;  ///< users of that script; 0: the scene's number

  std::uint32_t domain = 0;
  std::string secure;                ///< folder of its identity; empty: none
  std::string profile = {};          ///< of the network (deploy/dds); empty: CYCLONEDDS_URI decides
  std::optional<double> duration_s;  ///< empty: until stopped

  checkpoint::Settings checkpoint;
  bool standby = false;            ///< stand by for the session's live server
  std::uint32_t standby_rank = 1;  ///< of several, the one of the lowest takes over

  std::string hash_log;  ///< path; empty: none
  logging::LogOptions log;
  bool json = false;  ///< a report on stdout at the end

  std::optional<metrics::Address> metrics;  ///< empty: none are served

  configuration::Places places;  ///< of what comes from a file, for errors

  /// Returns what changed if the file was to be read again since the last call, or why it cannot be used.
  std::function<std::optional<Result<Changes>>()> changes = [] { return std::nullopt; };
};

}  // namespace tandem::daemon
