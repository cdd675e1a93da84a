#include "sdk/transport/secure/openssl.hpp"

#include <openssl/err.h>
#include <openssl/pem.h>

#include <array>
#include <ctime>

namespace tandem::transport::secure {
namespace {

// A key with a passphrase would otherwise ask for it on the terminal.
int no_passphrase(char* /*buffer*/, int /*size*/, int /*writing*/, void* /*user*/) { return -1; }

}  // namespace

OwnedBio reading(const std::string& text) {
  return OwnedBio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

std::string written(BIO* bio) {
  char* first = nullptr;
  const long size = BIO_get_mem_data(bio, &first);
  return {first, static_cast<std::size_t>(size)};
}

OwnedCertificate read_certificate(const std::string& pem) {
  OwnedCertificate found(PEM_read_bio_X509(reading(pem).get(), nullptr, &no_passphrase, nullptr));
  ERR_clear_error();
  return found;
}

OwnedKey read_key(const std::string& pem) {
  OwnedKey found(PEM_read_bio_PrivateKey(reading(pem).get(), nullptr, &no_passphrase, nullptr));
  ERR_clear_error();
  return found;
}

OwnedCrl read_crl(const std::string& pem) {
  OwnedCrl found(PEM_read_bio_X509_CRL(reading(pem).get(), nullptr, &no_passphrase, nullptr));
  ERR_clear_error();
  return found;
}

std::int64_t seconds_of(const ASN1_TIME* time) {
  std::tm parts{};
  if (ASN1_TIME_to_tm(time, &parts) != 1) return 0;
  return timegm(&parts);
}

std::string date_text(std::int64_t seconds) {
  const std::time_t time = seconds;
  std::tm parts{};
  gmtime_r(&time, &parts);
  std::array<char, 64> text{};
  const std::size_t size = std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S UTC", &parts);
  return {text.data(), size};
}

std::string subject_of(X509* certificate) {
  const OwnedBio bio(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(bio.get(), X509_get_subject_name(certificate), 0, XN_FLAG_RFC2253);
  return written(bio.get());
}

std::string subject_part(X509* certificate, int nid) {
  X509_NAME* const name = X509_get_subject_name(certificate);
  const int at = X509_NAME_get_index_by_NID(name, nid, -1);
  if (at < 0) return {};
  const ASN1_STRING* const value = X509_NAME_ENTRY_get_data(X509_NAME_get_entry(name, at));
  const auto* const first = static_cast<const void*>(ASN1_STRING_get0_data(value));
  return {static_cast<const char*>(first), static_cast<std::size_t>(ASN1_STRING_length(value))};
}

}  // namespace tandem::transport::secure
