#pragma once
// What DDS Security calls governance and permissions, as XML.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::pki {

/// What an identity is for. A standby is a server; a gateway acts for its viewers as one participant.
enum class Role : std::uint8_t { kServer, kParticipant, kObserver, kGateway, kOperator };

[[nodiscard]] std::string_view role_name(Role role);
[[nodiscard]] std::optional<Role> read_role(std::string_view name);

/// Topics that the role may write, and read. Everything else is denied.
struct Rights {
  std::vector<std::string_view> writes, reads;
};
[[nodiscard]] Rights rights_of(Role role);

/// The rules of the domain: strangers are kept out, and everything but their discovery is encrypted.
[[nodiscard]] std::string governance_xml();
/// What the identity with that subject (RFC 2253) may do from `from_s` to `until_s`, seconds since 1970.
[[nodiscard]] std::string permissions_xml(Role role, const std::string& subject, std::int64_t from_s,
                                          std::int64_t until_s);

}  // namespace tandem::pki
