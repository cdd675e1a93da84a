#pragma once
// What all actors of a world share.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sdk/transport/simulated/network.hpp"
#include "tests/fault/world/clock.hpp"
#include "tests/fault/world/journal.hpp"
#include "tests/fault/world/settings.hpp"
#include "tests/fault/world/truth.hpp"

namespace tandem::world {

class Server;

/// The first rule that was broken.
struct Finding {
  std::string invariant, who, what;
  std::int64_t at_ns = 0;
};

struct Stage {
  Settings settings;
  transport::simulated::Network network;
  Truth truth;
  Journal journal;
  std::vector<const Server*> servers;  ///< live or not
  std::int64_t now_ns = 0;
  std::optional<Finding> finding;
  std::uint64_t changes = 0;  ///< processes that were started or ended: links have to be set anew
  double next_unique = 0;     ///< what makes the next input unique
  /// Clients that a server of an epoch knows. Ids are random, and cannot be guessed; but who reads one before
  /// the server knows it can take it away (idl/STATES.md, "A known weakness").
  std::map<transport::ClientId, Epoch> known_ids;
  Epoch crashed_epoch = 0;  ///< of the last server that was killed while nothing else was wrong with it
  Epoch live_epoch = 0;     ///< of the server that runs; 0: none does
  std::int64_t handover_ns = -100 * kSecond;  ///< when an operator last asked for a handover

  explicit Stage(const Settings& drawn);
  [[nodiscard]] double unique() { return next_unique += 1e-6; }
  void blame(const char* invariant, std::string who, std::string what);
};

}  // namespace tandem::world
