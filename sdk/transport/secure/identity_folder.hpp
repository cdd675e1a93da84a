#pragma once
// The folder with what one program needs for DDS Security: its identity, and what it may do. `tandem pki`
// makes it.

#include <cstdint>
#include <string>

#include "tandem/result.hpp"

namespace tandem::transport::secure {

/// Names of the files in the folder.
inline constexpr const char* kIdentityCa = "identity_ca.pem";        ///< whose identities are believed
inline constexpr const char* kPermissionsCa = "permissions_ca.pem";  ///< whose permissions are believed
inline constexpr const char* kCertificate = "identity.pem";
inline constexpr const char* kKey = "key.pem";  ///< for its owner's eyes only
inline constexpr const char* kGovernance = "governance.p7s";
inline constexpr const char* kPermissions = "permissions.p7s";
inline constexpr const char* kRevoked = "crl.pem";  ///< identities that are not believed any more

/// No file may be larger.
inline constexpr std::int64_t kMaxFileBytes = 1 << 20;

/// What the folder says of its owner.
struct Identity {
  std::string folder;  ///< absolute
  std::string name;    ///< the certificate's common name
  std::string role;    ///< its organisational unit; empty in a folder that `tandem pki` did not make
  std::int64_t not_after_s = 0;  ///< its first file expires then; seconds since 1970
};

/// Checks every file as Cyclone DDS will, because its own errors name neither file nor cure: present, of this
/// size, readable, not to be changed by everybody, the key by its owner alone; whole; valid at `now_s`
/// (seconds since 1970); certificate, key and permissions of one identity; all signed by the authorities
/// beside them; and not revoked. Prints nothing. Errors, in one line with file and cure: kIo for a file that
/// cannot be read, otherwise kInvalidArgument.
[[nodiscard]] Result<Identity> check_identity_folder(const std::string& folder, std::int64_t now_s);

}  // namespace tandem::transport::secure
