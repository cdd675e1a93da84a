#pragma once
// The certificate of TLS: checked before it is used, and replaced while the gateway serves.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tandem/result.hpp"

struct evp_pkey_st;  // of OpenSSL, as are the others
struct ssl_ctx_st;
struct x509_st;

namespace tandem::gateway {

/// A certificate with its chain and its key. Not thread-safe.
class Certificate {
 public:
  /// Reads two files of PEM. Refused: a file that is cut short, a key that everybody can read, a key of
  /// another certificate, and a certificate whose time is over or has not begun. Errors: kIo, kCapacity,
  /// kInvalidArgument; the message names file and cure.
  [[nodiscard]] static Result<Certificate> read(const std::string& cert_path, const std::string& key_path,
                                                std::int64_t now_s);

  /// New connections get it. Errors: kInternal; what was used before is used further.
  [[nodiscard]] Result<void> use(ssl_ctx_st* context) const;
  /// When it ends, as people write it.
  [[nodiscard]] const std::string& until() const { return until_; }

 private:
  std::shared_ptr<evp_pkey_st> key_;
  std::vector<std::shared_ptr<x509_st>> chain_;  // the server's own is the first
  std::string until_;
};

}  // namespace tandem::gateway
