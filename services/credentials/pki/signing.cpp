#include "services/credentials/pki/signing.hpp"

#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <array>

namespace tandem::pki {
namespace {

using namespace transport::secure;

using OwnedNumber = Owned<BIGNUM, &BN_free>;
using OwnedInteger = Owned<ASN1_INTEGER, &ASN1_INTEGER_free>;
using OwnedTime = Owned<ASN1_TIME, &ASN1_TIME_free>;
using OwnedExtension = Owned<X509_EXTENSION, &X509_EXTENSION_free>;

constexpr int kSerialBits = 127;  // positive, in 16 octets

tl::unexpected<Error> refused(const char* doing) {
  std::array<char, 256> why{};
  ERR_error_string_n(ERR_get_error(), why.data(), why.size());
  ERR_clear_error();
  return fail(ErrorCode::kUnsupported, std::string("OpenSSL refused ") + doing + ": " + why.data());
}

bool set_random_serial(X509* certificate) {
  const OwnedNumber number(BN_new());
  return BN_rand(number.get(), kSerialBits, BN_RAND_TOP_ANY, BN_RAND_BOTTOM_ANY) == 1 &&
         BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate)) != nullptr;
}

bool add_name(X509_NAME* name, const char* part, const std::string& value) {
  return X509_NAME_add_entry_by_txt(
             name, part, MBSTRING_UTF8,
             reinterpret_cast<const unsigned char*>(value.data()),  // OpenSSL's type of text
             static_cast<int>(value.size()), -1, 0) == 1;
}

bool add_extension(X509* certificate, X509* issuer, int nid, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const OwnedExtension extension(X509V3_EXT_conf_nid(nullptr, &context, nid, value));
  return extension != nullptr && X509_add_ext(certificate, extension.get(), -1) == 1;
}

/// A certificate with a new key, without extensions and signature.
bool begin(Signer& made, const std::string& role, const std::string& name, const Validity& valid) {
  made.key.reset(EVP_EC_gen("prime256v1"));
  made.certificate.reset(X509_new());
  X509* const certificate = made.certificate.get();
  if (made.key == nullptr || certificate == nullptr) return false;
  X509_NAME* const subject = X509_get_subject_name(certificate);
  return X509_set_version(certificate, X509_VERSION_3) == 1 && set_random_serial(certificate) &&
         ASN1_TIME_set(X509_getm_notBefore(certificate), valid.from_s) != nullptr &&
         ASN1_TIME_set(X509_getm_notAfter(certificate), valid.until_s) != nullptr &&
         add_name(subject, "O", "tandem") && (role.empty() || add_name(subject, "OU", role)) &&
         add_name(subject, "CN", name) && X509_set_pubkey(certificate, made.key.get()) == 1;
}

}  // namespace

Result<Signer> make_authority(const std::string& name, const Validity& valid) {
  Signer made;
  const bool good =
      begin(made, "", name, valid) &&
      X509_set_issuer_name(made.certificate.get(), X509_get_subject_name(made.certificate.get())) == 1;
  X509* const self = made.certificate.get();
  // Documents are signed by the authority itself, so it also needs the right to sign what is no certificate.
  if (!good || !add_extension(self, self, NID_basic_constraints, "critical,CA:TRUE,pathlen:0") ||
      !add_extension(self, self, NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature") ||
      !add_extension(self, self, NID_subject_key_identifier, "hash") ||
      X509_sign(self, made.key.get(), EVP_sha256()) == 0)
    return refused("to make an authority");
  return made;
}

Result<Signer> make_identity(const Signer& authority, const std::string& role, const std::string& name,
                             const Validity& valid) {
  Signer made;
  X509* const issuer = authority.certificate.get();
  const bool good = begin(made, role, name, valid) &&
                    X509_set_issuer_name(made.certificate.get(), X509_get_subject_name(issuer)) == 1;
  X509* const self = made.certificate.get();
  if (!good || !add_extension(self, issuer, NID_basic_constraints, "critical,CA:FALSE") ||
      !add_extension(self, issuer, NID_key_usage, "critical,digitalSignature,keyAgreement") ||
      !add_extension(self, issuer, NID_authority_key_identifier, "keyid:always") ||
      X509_sign(self, authority.key.get(), EVP_sha256()) == 0)
    return refused("to make an identity");
  return made;
}

Result<std::string> sign_document(const Signer& authority, const std::string& text) {
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED | PKCS7_STREAM;
  const OwnedBio content = reading(text);
  const OwnedDocument signature(
      PKCS7_sign(authority.certificate.get(), authority.key.get(), nullptr, content.get(), kFlags));
  const OwnedBio out(BIO_new(BIO_s_mem()));
  if (signature == nullptr || SMIME_write_PKCS7(out.get(), signature.get(), content.get(), kFlags) != 1)
    return refused("to sign a document");
  return written(out.get());
}

Result<std::string> make_revoked_list(const Signer& authority, const std::vector<Revocation>& revoked,
                                      const Validity& valid) {
  const OwnedCrl list(X509_CRL_new());
  const OwnedTime from(ASN1_TIME_set(nullptr, valid.from_s));
  const OwnedTime until(ASN1_TIME_set(nullptr, valid.until_s));
  bool good = list != nullptr && X509_CRL_set_version(list.get(), X509_CRL_VERSION_2) == 1 &&
              X509_CRL_set_issuer_name(list.get(), X509_get_subject_name(authority.certificate.get())) == 1 &&
              X509_CRL_set1_lastUpdate(list.get(), from.get()) == 1 &&
              X509_CRL_set1_nextUpdate(list.get(), until.get()) == 1;
  for (const Revocation& one : revoked) {
    BIGNUM* parsed = nullptr;
    good = good && BN_hex2bn(&parsed, one.serial.c_str()) > 0;
    const OwnedNumber number(parsed);
    if (!good) break;
    const OwnedInteger serial(BN_to_ASN1_INTEGER(number.get(), nullptr));
    const OwnedTime at(ASN1_TIME_set(nullptr, one.at_s));
    X509_REVOKED* const entry = X509_REVOKED_new();
    good = X509_REVOKED_set_serialNumber(entry, serial.get()) == 1 &&
           X509_REVOKED_set_revocationDate(entry, at.get()) == 1;
    // The list owns its entries.
    if (!good || X509_CRL_add0_revoked(list.get(), entry) != 1) {
      X509_REVOKED_free(entry);
      good = false;
    }
  }
  const OwnedBio out(BIO_new(BIO_s_mem()));
  if (!good || X509_CRL_sort(list.get()) != 1 ||
      X509_CRL_sign(list.get(), authority.key.get(), EVP_sha256()) == 0 ||
      PEM_write_bio_X509_CRL(out.get(), list.get()) != 1)
    return refused("to make a list of revoked identities");
  return written(out.get());
}

std::string certificate_pem(X509* certificate) {
  const OwnedBio out(BIO_new(BIO_s_mem()));
  PEM_write_bio_X509(out.get(), certificate);
  return written(out.get());
}

std::string key_pem(EVP_PKEY* key) {
  const OwnedBio out(BIO_new(BIO_s_secmem()));
  PEM_write_bio_PrivateKey(out.get(), key, nullptr, nullptr, 0, nullptr, nullptr);
  return written(out.get());
}

std::string serial_of(X509* certificate) {
  const OwnedNumber number(ASN1_INTEGER_to_BN(X509_get0_serialNumber(certificate), nullptr));
  char* const digits = BN_bn2hex(number.get());
  std::string text = digits;
  OPENSSL_free(digits);
  return text;
}

}  // namespace tandem::pki
