#pragma once
// The transports that this library was built with.

#include <cstdint>
#include <memory>
#include <string>

#include "sdk/wire/port.hpp"
#include "tandem/result.hpp"
#include "tandem/tandem.h"

namespace tandem::api {

inline constexpr std::uint32_t kMaxDomain = 230;  ///< as transport::kMaxDomain, also without DDS

/// The port of a client over DDS, or over WebSocket if the options have a URL. Errors: those of the port;
/// kUnsupported, if the library was built without that transport.
[[nodiscard]] Result<std::unique_ptr<transport::ClientPort>> open_port(const tandem_options& options,
                                                                       const std::string& session,
                                                                       transport::ClientId client);

}  // namespace tandem::api
