#pragma once
// Makes clients with handles for any port.

#include <memory>

#include "sdk/client/api/running_client.hpp"
#include "tandem/tandem.h"

namespace tandem::api {

/// tandem_join() with the caller's port and clock. `clock`: null for the system's.
tandem_result join_over(std::unique_ptr<transport::ClientPort> port, RunningClient::Clock clock,
                        const tandem_options* options, tandem_client* client) noexcept;

}  // namespace tandem::api
