#pragma once
// Owners of OpenSSL's objects, and the few readings of them that more than one file needs.

#include <openssl/asn1.h>
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>

#include <cstdint>
#include <memory>
#include <string>

namespace tandem::transport::secure {

template <auto free>
struct Freed {
  template <class T>
  void operator()(T* object) const {
    free(object);
  }
};
template <class T, auto free>
using Owned = std::unique_ptr<T, Freed<free>>;

using OwnedBio = Owned<BIO, &BIO_free_all>;
using OwnedKey = Owned<EVP_PKEY, &EVP_PKEY_free>;
using OwnedCertificate = Owned<X509, &X509_free>;
using OwnedCrl = Owned<X509_CRL, &X509_CRL_free>;
using OwnedDocument = Owned<PKCS7, &PKCS7_free>;
using OwnedStore = Owned<X509_STORE, &X509_STORE_free>;

/// `text` must outlive the result.
[[nodiscard]] OwnedBio reading(const std::string& text);
/// What was written to a memory BIO.
[[nodiscard]] std::string written(BIO* bio);

/// The first object of that kind in PEM text; null if there is none.
[[nodiscard]] OwnedCertificate read_certificate(const std::string& pem);
[[nodiscard]] OwnedKey read_key(const std::string& pem);
[[nodiscard]] OwnedCrl read_crl(const std::string& pem);

/// Seconds since 1970.
[[nodiscard]] std::int64_t seconds_of(const ASN1_TIME* time);
/// "2026-11-24 00:30:12 UTC"
[[nodiscard]] std::string date_text(std::int64_t seconds);

/// The subject as RFC 2253 writes it, which permissions name: "CN=alice,OU=participant,O=tandem".
[[nodiscard]] std::string subject_of(X509* certificate);
/// One part of the subject, such as NID_commonName; empty if there is none.
[[nodiscard]] std::string subject_part(X509* certificate, int nid);

}  // namespace tandem::transport::secure
