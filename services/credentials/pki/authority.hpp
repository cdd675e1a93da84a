#pragma once
// The folder of an operator's authorities, and the identities that they issued.
//
//   DIR/authority/   keys and certificates of both authorities, governance, the register
//   DIR/NAME/        one identity's folder (sdk/transport/secure), to be copied to where it is used
//
// Two authorities, because whoever holds an identity that the permissions authority signed could sign
// permissions.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/credentials/pki/documents.hpp"
#include "services/credentials/pki/signing.hpp"
#include "services/program/system/descriptor.hpp"
#include "tandem/result.hpp"

namespace tandem::pki {

inline constexpr std::int64_t kDay = 86'400;  ///< seconds
/// What is new is valid from this long ago, for machines whose clocks are a little behind.
inline constexpr std::int64_t kBackdated = 300;
inline constexpr std::int64_t kAuthorityDays = 3650;
/// A list of revoked identities is believed for so long; a machine with an older one refuses to start.
inline constexpr std::int64_t kRevokedListDays = 3650;
inline constexpr std::int64_t kMaxDays = 3650;

/// 365 days for what runs unattended, 90 for what people hold.
[[nodiscard]] std::int64_t usual_days(Role role);

/// One identity that was issued.
struct Issued {
  std::string name;
  Role role = Role::kObserver;
  std::string serial;                     ///< hexadecimal digits
  std::int64_t until_s = 0;               ///< seconds since 1970
  std::optional<std::int64_t> revoked_s;  ///< when
};

/// A name: 1 to 64 of A-Z, a-z, 0-9, '.', '_' and '-', not beginning with '.' or '-', and not "authority".
[[nodiscard]] Result<void> check_identity_name(const std::string& name);

/// Holds the folder alone, against other processes. Errors of all members: kIo (a file), kConflict (the
/// folder is in use, or there is such a thing already), kInvalidArgument, kUnsupported (OpenSSL refused).
/// Times are seconds since 1970. Keys are written, and never returned.
class Authority {
 public:
  /// Makes both authorities in a folder that has none.
  static Result<Authority> init(const std::string& folder, std::int64_t now_s);
  static Result<Authority> open(const std::string& folder);

  /// Makes an identity and its folder. `valid_s`: how long, at most until the authorities expire.
  Result<Issued> issue(Role role, const std::string& name, std::int64_t valid_s, std::int64_t now_s);
  /// Makes a new key, certificate and permissions in the same role. What was issued before stays good until
  /// it expires or is revoked. A revoked name is good again.
  Result<Issued> renew(const std::string& name, std::optional<std::int64_t> valid_s, std::int64_t now_s);
  /// Puts all that was issued to that name on the list of revoked identities, in every folder.
  Result<void> revoke(const std::string& name, std::int64_t now_s);

  /// All that was issued, oldest first.
  [[nodiscard]] const std::vector<Issued>& register_of() const { return issued_; }
  [[nodiscard]] std::string folder_of(const std::string& name) const { return folder_ + "/" + name; }
  [[nodiscard]] std::int64_t until_s() const;  ///< the authorities expire then

 private:
  Authority(std::string folder, system::Descriptor lock)
      : folder_(std::move(folder)), lock_(std::move(lock)) {}
  Result<void> load();
  Result<void> make(std::int64_t now_s);
  Result<Issued> write_identity(Role role, const std::string& name, std::int64_t valid_s, std::int64_t now_s);
  Result<void> write_register() const;
  Result<void> write_revoked_list(std::int64_t now_s) const;
  [[nodiscard]] std::string own(const char* file) const { return folder_ + "/authority/" + file; }

  std::string folder_;
  system::Descriptor lock_;
  Signer identities_, permissions_;
  std::string governance_;  // signed
  std::vector<Issued> issued_;
};

}  // namespace tandem::pki
