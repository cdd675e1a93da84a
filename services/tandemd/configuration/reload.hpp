#pragma once
// SIGHUP: a running server reads its configuration file again, and changes what can change while clients
// play.

#include <string>
#include <string_view>

#include "server.pb.h"
#include "services/tandemd/configuration/options.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// True for a field that a running server can change: who else may come, how long one may delay the others,
/// how often the world is written. All else is announced to clients, or is the world itself.
[[nodiscard]] bool changes_live(std::string_view field);

/// Reads a configuration file again and again, and says what changed since. Flags keep their effect.
class Rereader {
 public:
  Rereader(std::string path, idl::ServerConfig flags, idl::ServerConfig in_force);

  /// Fields that cannot change live stay as they are in the configuration in force, so that each call names
  /// them. Errors: as load_config() and check_config(); then nothing changes.
  [[nodiscard]] Result<Changes> read();

 private:
  std::string path_;
  idl::ServerConfig flags_, in_force_;
};

}  // namespace tandem::daemon
