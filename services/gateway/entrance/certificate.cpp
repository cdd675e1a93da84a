#include "services/gateway/entrance/certificate.hpp"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

#include <ctime>

#include "services/credentials/tokens/secret_file.hpp"

namespace tandem::gateway {
namespace {

using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;

Bio reader(const std::string& text) {
  return {BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), &BIO_free};
}

int no_password(char* /*buffer*/, int /*size*/, int /*writes*/, void* /*user*/) { return -1; }

std::string time_text(const ASN1_TIME* time) {
  const Bio out(BIO_new(BIO_s_mem()), &BIO_free);
  char* text = nullptr;
  ASN1_TIME_print(out.get(), time);
  const long size = BIO_get_mem_data(out.get(), &text);
  return {text, static_cast<std::size_t>(size)};
}

tl::unexpected<Error> refuse(std::string message) {
  ERR_clear_error();
  return fail(ErrorCode::kInvalidArgument, std::move(message));
}

}  // namespace

Result<Certificate> Certificate::read(const std::string& cert_path, const std::string& key_path,
                                      std::int64_t now_s) {
  const auto cert_text = tokens::read_file(cert_path, tokens::Others::kMayNotWrite);
  if (!cert_text) return tl::unexpected(cert_text.error());
  const auto key_text = tokens::read_file(key_path, tokens::Others::kMayNotRead);
  if (!key_text) return tl::unexpected(key_text.error());
  Certificate read;
  const Bio certs = reader(*cert_text);
  while (X509* const one = PEM_read_bio_X509(certs.get(), nullptr, no_password, nullptr))
    read.chain_.emplace_back(one, &X509_free);
  // At the end of a good file there is no further beginning; anything else is a broken part.
  const bool whole = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  if (read.chain_.empty() || !whole)
    return refuse(fmt::format("{}: is no certificate chain in PEM, or is cut short", cert_path));
  ERR_clear_error();
  read.key_ = {PEM_read_bio_PrivateKey(reader(*key_text).get(), nullptr, no_password, nullptr),
               &EVP_PKEY_free};
  if (!read.key_)
    return refuse(fmt::format("{}: is no private key in PEM without a password, or is cut short", key_path));
  if (X509_check_private_key(read.chain_.front().get(), read.key_.get()) != 1)
    return refuse(fmt::format("{} and {} do not belong together: the key is of another certificate",
                              cert_path, key_path));
  std::time_t now = now_s;
  for (const auto& one : read.chain_) {
    const ASN1_TIME *from = X509_get0_notBefore(one.get()), *until = X509_get0_notAfter(one.get());
    if (X509_cmp_time(until, &now) <= 0)
      return refuse(fmt::format("{}: a certificate expired on {}: renew it", cert_path, time_text(until)));
    if (X509_cmp_time(from, &now) > 0)
      return refuse(fmt::format("{}: a certificate holds from {} only: look at this machine's clock",
                                cert_path, time_text(from)));
  }
  read.until_ = time_text(X509_get0_notAfter(read.chain_.front().get()));
  ERR_clear_error();
  return read;
}

Result<void> Certificate::use(ssl_ctx_st* context) const {
  const std::unique_ptr<STACK_OF(X509), void (*)(STACK_OF(X509)*)> rest(
      sk_X509_new_null(), [](STACK_OF(X509) * stack) { sk_X509_free(stack); });
  for (std::size_t i = 1; i < chain_.size(); ++i) sk_X509_push(rest.get(), chain_[i].get());
  constexpr int kReplace = 1;
  const bool used =
      SSL_CTX_use_cert_and_key(context, chain_.front().get(), key_.get(), rest.get(), kReplace) == 1;
  ERR_clear_error();
  if (used) return {};
  return fail(ErrorCode::kInternal, "OpenSSL does not take the certificate");
}

}  // namespace tandem::gateway
