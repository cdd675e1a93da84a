#pragma once
// The name of a site on NATS.

#include <string>

namespace tandem::transport::nats {

/// The host's name up to its first dot, if a site may be called so; otherwise "site".
[[nodiscard]] std::string default_site_name();
/// Why the text is no site's name; empty: it is one.
[[nodiscard]] std::string refusal_of_site_name(const std::string& text);

}  // namespace tandem::transport::nats
