#include "services/credentials/tokens/keys.hpp"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/sha.h>
#include <unistd.h>

#include <utility>

#include "services/credentials/tokens/secret_file.hpp"

namespace tandem::tokens {
namespace {

using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;
using Digest = std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)>;

/// OpenSSL keeps errors for its next caller in this thread, who may be libwebsockets.
struct ForgetErrors {
  ForgetErrors() = default;
  ForgetErrors(const ForgetErrors&) = delete;
  ForgetErrors& operator=(const ForgetErrors&) = delete;
  ForgetErrors(ForgetErrors&&) = delete;
  ForgetErrors& operator=(ForgetErrors&&) = delete;
  ~ForgetErrors() { ERR_clear_error(); }
};

std::shared_ptr<EVP_PKEY> shared(EVP_PKEY* key) { return {key, &EVP_PKEY_free}; }

const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

Bio reader(const std::string& text) {
  return {BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), &BIO_free};
}

// Otherwise OpenSSL asks the terminal for the password of an encrypted key.
int no_password(char* /*buffer*/, int /*size*/, int /*writes*/, void* /*user*/) { return -1; }

bool is_ed25519(const std::shared_ptr<EVP_PKEY>& key) {
  return key != nullptr && EVP_PKEY_is_a(key.get(), "ED25519") == 1;
}

std::string raw_public(EVP_PKEY* key) {
  std::array<unsigned char, 32> raw{};
  std::size_t size = raw.size();
  EVP_PKEY_get_raw_public_key(key, raw.data(), &size);
  return {reinterpret_cast<const char*>(raw.data()), size};
}

template <class Write>
std::string to_pem(Write write) {
  const Bio out(BIO_new(BIO_s_mem()), &BIO_free);
  char* text = nullptr;
  if (write(out.get()) != 1) return {};
  const long size = BIO_get_mem_data(out.get(), &text);
  return {text, static_cast<std::size_t>(size)};
}

}  // namespace

Fingerprint fingerprint(std::string_view bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> hash{};
  SHA256(bytes_of(bytes), bytes.size(), hash.data());
  Fingerprint first = 0;
  for (std::size_t i = 0; i < sizeof first; ++i) first = first << 8U | hash[i];
  return first == 0 ? 1 : first;
}

PublicKey::PublicKey(std::shared_ptr<evp_pkey_st> key)
    : key_(std::move(key)), id_(fingerprint(raw_public(key_.get()))) {}

Result<PublicKey> PublicKey::read(const std::string& path) {
  const ForgetErrors forget;
  const auto text = read_file(path, Others::kMayNotWrite);
  if (!text) return tl::unexpected(text.error());
  if (text->find("PRIVATE KEY-----") != std::string::npos) {
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("{}: holds the secret key, which makes tokens; who checks them gets the public one, "
                    "{}.pub",
                    path, path));
  }
  const auto key = shared(PEM_read_bio_PUBKEY(reader(*text).get(), nullptr, no_password, nullptr));
  if (!is_ed25519(key)) {
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("{}: is no public key of Ed25519 in PEM; `tandem pki token-key` makes a pair", path));
  }
  return PublicKey(key);
}

bool PublicKey::fits(const Signature& signature, std::string_view message) const {
  const ForgetErrors forget;
  const Digest digest(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  return EVP_DigestVerifyInit(digest.get(), nullptr, nullptr, nullptr, key_.get()) == 1 &&
         EVP_DigestVerify(digest.get(), signature.data(), signature.size(), bytes_of(message),
                          message.size()) == 1;
}

Result<SecretKey> SecretKey::make() {
  const ForgetErrors forget;
  auto key = shared(EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519"));
  if (key == nullptr) return fail(ErrorCode::kInternal, "OpenSSL made no key: is there randomness?");
  return SecretKey(std::move(key));
}

Result<SecretKey> SecretKey::read(const std::string& path) {
  const ForgetErrors forget;
  const auto text = read_file(path, Others::kNorTheirGroup);
  if (!text) return tl::unexpected(text.error());
  auto key = shared(PEM_read_bio_PrivateKey(reader(*text).get(), nullptr, no_password, nullptr));
  if (!is_ed25519(key)) {
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("{}: is no secret key of Ed25519 in PEM without a password; `tandem pki token-key` "
                    "makes one",
                    path));
  }
  return SecretKey(std::move(key));
}

Result<void> SecretKey::write(const std::string& path) const {
  const ForgetErrors forget;
  const std::string secret = to_pem([this](BIO* out) {
    return PEM_write_bio_PrivateKey(out, key_.get(), nullptr, nullptr, 0, nullptr, nullptr);
  });
  const std::string open = to_pem([this](BIO* out) { return PEM_write_bio_PUBKEY(out, key_.get()); });
  if (auto written = write_new_file(path, secret, 0600); !written) return written;
  auto written = write_new_file(path + ".pub", open, 0644);
  if (!written) ::unlink(path.c_str());
  return written;
}

Signature SecretKey::sign(std::string_view message) const {
  const ForgetErrors forget;
  const Digest digest(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  Signature signature{};
  std::size_t size = signature.size();
  EVP_DigestSignInit(digest.get(), nullptr, nullptr, nullptr, key_.get());
  EVP_DigestSign(digest.get(), signature.data(), &size, bytes_of(message), message.size());
  return signature;
}

PublicKey SecretKey::public_key() const { return PublicKey(key_); }

}  // namespace tandem::tokens
