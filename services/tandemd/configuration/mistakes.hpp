#pragma once
// All that is wrong with a configuration, for --check-config. A start stops at the first mistake.

#include <string>
#include <vector>

#include "server.pb.h"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// Finds the mistakes in a configuration file and in the flags that go with it; `path` is empty without a
/// file. Each is as load_config(), check_config() or rehearse() says it; those of the file are in the order
/// of its lines. What may be wrong only because of another mistake is left out. Empty: a start would not be
/// refused.
[[nodiscard]] std::vector<Error> find_mistakes(const std::string& path, const idl::ServerConfig& flags);

}  // namespace tandem::daemon
