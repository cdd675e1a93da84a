#pragma once
// Keys, certificates and signatures, by OpenSSL's library. Times are seconds since 1970.

#include <cstdint>
#include <string>
#include <vector>

#include "sdk/transport/secure/openssl.hpp"
#include "tandem/result.hpp"

namespace tandem::pki {

/// An authority, or an identity that is new.
struct Signer {
  transport::secure::OwnedCertificate certificate;
  transport::secure::OwnedKey key;
};

struct Validity {
  std::int64_t from_s = 0, until_s = 0;
};

/// An entry of a list of revoked identities. `serial`: hexadecimal digits.
struct Revocation {
  std::string serial;
  std::int64_t at_s = 0;
};

/// Makes an authority with a new key (EC prime256v1), signed by itself. Errors: kUnsupported (OpenSSL
/// refused).
[[nodiscard]] Result<Signer> make_authority(const std::string& name, const Validity& valid);
/// Makes an identity with a new key: subject O=tandem, OU=`role`, CN=`name`, with a random serial number.
[[nodiscard]] Result<Signer> make_identity(const Signer& authority, const std::string& role,
                                           const std::string& name, const Validity& valid);
/// The text as S/MIME with a detached signature, as DDS Security wants it.
[[nodiscard]] Result<std::string> sign_document(const Signer& authority, const std::string& text);
/// The list in PEM.
[[nodiscard]] Result<std::string> make_revoked_list(const Signer& authority,
                                                    const std::vector<Revocation>& revoked,
                                                    const Validity& valid);

[[nodiscard]] std::string certificate_pem(X509* certificate);
/// Without a passphrase.
[[nodiscard]] std::string key_pem(EVP_PKEY* key);
/// Hexadecimal digits.
[[nodiscard]] std::string serial_of(X509* certificate);

}  // namespace tandem::pki
