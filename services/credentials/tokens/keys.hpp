#pragma once
// The pair of Ed25519 keys behind tokens: the secret one makes them, the public one checks them.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "tandem/result.hpp"

struct evp_pkey_st;  // of OpenSSL

namespace tandem::tokens {

inline constexpr std::size_t kSignatureBytes = 64;
using Signature = std::array<std::uint8_t, kSignatureBytes>;

/// Tells keys and texts apart in a program's memory and log: the first 64 bits of SHA-256. Never 0.
using Fingerprint = std::uint64_t;
[[nodiscard]] Fingerprint fingerprint(std::string_view bytes);

/// Copies share the key, which does not change. Thread-safe.
class PublicKey {
 public:
  /// Reads PEM ("PUBLIC KEY"). Refused: a file that everybody can write, a secret key (which the checking
  /// side should not hold), any key but of Ed25519. Errors: kIo, kInvalidArgument, kCapacity.
  [[nodiscard]] static Result<PublicKey> read(const std::string& path);

  /// Takes the same steps for every wrong signature.
  [[nodiscard]] bool fits(const Signature& signature, std::string_view message) const;
  [[nodiscard]] Fingerprint id() const { return id_; }

 private:
  friend class SecretKey;
  explicit PublicKey(std::shared_ptr<evp_pkey_st> key);
  std::shared_ptr<evp_pkey_st> key_;
  Fingerprint id_ = 0;
};

/// Thread-safe.
class SecretKey {
 public:
  /// A new one. Errors: kInternal (no randomness).
  [[nodiscard]] static Result<SecretKey> make();
  /// Reads PEM ("PRIVATE KEY", not encrypted). Refused: a file that anybody but its owner can read. Errors:
  /// as those of PublicKey::read().
  [[nodiscard]] static Result<SecretKey> read(const std::string& path);

  /// Writes PATH, which only its owner can read, and PATH.pub. Files that are there are not touched. Errors:
  /// kConflict, kIo.
  [[nodiscard]] Result<void> write(const std::string& path) const;
  [[nodiscard]] Signature sign(std::string_view message) const;
  [[nodiscard]] PublicKey public_key() const;

 private:
  explicit SecretKey(std::shared_ptr<evp_pkey_st> key) : key_(std::move(key)) {}
  std::shared_ptr<evp_pkey_st> key_;
};

}  // namespace tandem::tokens
