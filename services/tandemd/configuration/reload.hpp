#pragma once
// SIGHUP: a running server reads its configuration file again, and changes what is marked as live in
// idl/server.proto. All else is announced to clients, or is the world itself.

#include <string>

#include "server.pb.h"
#include "services/tandemd/configuration/options.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

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
