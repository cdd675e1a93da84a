#pragma once
// Is an announced session one that this build can play?

#include "sdk/core/layout/layout.hpp"
#include "sdk/transport/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::client {

/// Checks version, layout hash and every declared size, and returns what a timeline is made from. An
/// announcement is untrusted bytes: nothing is allocated from it before it passed here. Errors: kUnsupported
/// (protocol version), kMismatch (layout hash), kMalformed (a value out of range).
[[nodiscard]] Result<Layout> check_session(const transport::SessionMessage& session);

}  // namespace tandem::client
