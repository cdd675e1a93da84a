#pragma once
// Who can reach DDS here, by its configuration: interfaces may come up after the start.

#include <string>

namespace tandem::transport {

/// The text of CYCLONEDDS_URI's XML, with that of the files which it names. A file that cannot be read counts
/// as empty: Cyclone DDS says that.
[[nodiscard]] std::string configuration_text(const std::string& uri);

/// Over what others reach DDS: "eth0, eth1" or "its network". Empty: over nothing, as it is told to use
/// loopback alone. `profile`: as --profile has it; empty: none, and the text of CYCLONEDDS_URI decides.
[[nodiscard]] std::string reach_of_dds(const std::string& profile, const std::string& configuration);

/// What a server without DDS Security has to say to its operator, in one line; empty if nobody else reaches
/// it, by CYCLONEDDS_URI or the profile. `secure`: its identity; with one there is nothing to say.
[[nodiscard]] std::string warning_without_security(const std::string& profile, const std::string& secure);

}  // namespace tandem::transport
