#include "sdk/transport/secure/identity_folder.hpp"

#include <fcntl.h>
#include <openssl/err.h>
#include <openssl/objects.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "sdk/transport/secure/openssl.hpp"

namespace tandem::transport::secure {
namespace {

constexpr mode_t kOthersWrite = 02;
constexpr const char* kCopyAgain = "copy the whole folder anew from where `tandem pki issue` made it";

tl::unexpected<Error> bad(const std::string& file, const std::string& what, const std::string& cure) {
  return fail(ErrorCode::kInvalidArgument, file + " " + what + ": " + cure);
}

std::string mode_text(mode_t mode) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "%04o", static_cast<unsigned>(mode & 07777U));
  return text.data();
}

/// The rights that nobody but a key's owner may have. Newer versions of systemd (257 at least) keep what they
/// hand to a service as root's, and have the service's user on its access list, whose mask stands where the
/// rights of the group do.
mode_t rights_of_others(const std::string& folder) {
  const char* const handed_over = std::getenv("CREDENTIALS_DIRECTORY");
  std::error_code error;
  return handed_over != nullptr && std::filesystem::equivalent(folder, handed_over, error) ? 037U : 077U;
}

/// Reads the folder's files.
class Folder {
 public:
  explicit Folder(std::string path) : path_(std::move(path)) {}

  [[nodiscard]] std::string file(const char* name) const { return path_ + "/" + name; }
  [[nodiscard]] Result<std::string> read(const char* name) const {
    const std::string path = file(name);
    // Not blocking, so that a pipe of that name stops nobody.
    const int opened = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (opened < 0) {
      const int reason = errno;
      if (reason == ENOENT || reason == ENOTDIR)
        return fail(ErrorCode::kIo, path + " is missing: " + kCopyAgain);
      return fail(ErrorCode::kIo, path + " cannot be read (" + std::strerror(reason) +
                                      "): make the user that runs this program its owner (chown)");
    }
    auto text = read_from(opened, path, name);
    ::close(opened);
    return text;
  }

 private:
  [[nodiscard]] Result<std::string> read_from(int opened, const std::string& path, const char* name) const {
    struct stat about {};
    if (::fstat(opened, &about) != 0 || !S_ISREG(about.st_mode)) return bad(path, "is no file", kCopyAgain);
    const bool secret = std::string_view(name) == kKey;
    if (secret && (about.st_mode & rights_of_others(path_)) != 0) {
      return bad(path, "can be read by others than its owner (mode " + mode_text(about.st_mode) + ")",
                 "chmod 600 " + path + ", and `tandem pki renew` if somebody may have read it");
    }
    if ((about.st_mode & kOthersWrite) != 0)
      return bad(path, "can be changed by everybody (mode " + mode_text(about.st_mode) + ")",
                 "chmod o-w " + path + ", after comparing it with the original");
    if (about.st_size == 0 || about.st_size > kMaxFileBytes)
      return bad(path, "has " + std::to_string(about.st_size) + " bytes", kCopyAgain);
    std::string text(static_cast<std::size_t>(about.st_size), '\0');
    std::size_t had = 0;
    while (had < text.size()) {
      const ssize_t more = ::read(opened, text.data() + had, text.size() - had);
      if (more <= 0) return fail(ErrorCode::kIo, path + " cannot be read: " + kCopyAgain);
      had += static_cast<std::size_t>(more);
    }
    return text;
  }

  std::string path_;
};

/// Errors where `now_s` is outside of the time in which `file` is valid.
Result<void> check_time(const std::string& file, std::int64_t not_before_s, std::int64_t not_after_s,
                        std::int64_t now_s, const std::string& cure) {
  if (now_s < not_before_s)
    return bad(
        file,
        "is valid from " + date_text(not_before_s) + ", and this machine's clock says " + date_text(now_s),
        "set the clock (timedatectl set-ntp true)");
  if (now_s > not_after_s)
    return bad(file,
               "expired on " + date_text(not_after_s) + ", and this machine's clock says " + date_text(now_s),
               cure + ", or set the clock if it is wrong");
  return {};
}

Result<void> check_time(const std::string& file, X509* certificate, std::int64_t now_s,
                        const std::string& cure) {
  return check_time(file, seconds_of(X509_get0_notBefore(certificate)),
                    seconds_of(X509_get0_notAfter(certificate)), now_s, cure);
}

Result<OwnedCertificate> read_authority(const Folder& folder, const char* name, std::int64_t now_s) {
  const auto text = folder.read(name);
  if (!text) return tl::unexpected(text.error());
  OwnedCertificate authority = read_certificate(*text);
  if (authority == nullptr) return bad(folder.file(name), "is no whole certificate", kCopyAgain);
  if (X509_check_ca(authority.get()) == 0)
    return bad(folder.file(name), "is not the certificate of an authority", kCopyAgain);
  if (auto valid =
          check_time(folder.file(name), authority.get(), now_s, "make new ones with `tandem pki init`");
      !valid)
    return tl::unexpected(valid.error());
  return authority;
}

/// The signed text of an S/MIME document; null where the authority did not sign it so.
std::optional<std::string> signed_text(const std::string& document, X509* authority, std::int64_t now_s) {
  BIO* content = nullptr;
  const OwnedDocument parsed(SMIME_read_PKCS7(reading(document).get(), &content));
  const OwnedBio body(content);
  const OwnedStore store(X509_STORE_new());
  const OwnedBio out(BIO_new(BIO_s_mem()));
  bool good = false;
  if (parsed != nullptr && X509_STORE_add_cert(store.get(), authority) == 1) {
    X509_VERIFY_PARAM_set_time(X509_STORE_get0_param(store.get()), now_s);
    good = PKCS7_verify(parsed.get(), nullptr, store.get(), body.get(), out.get(), PKCS7_TEXT) == 1;
  }
  ERR_clear_error();
  if (!good) return std::nullopt;
  return written(out.get());
}

Result<std::string> read_document(const Folder& folder, const char* name, const char* element,
                                  X509* authority, std::int64_t now_s) {
  const auto document = folder.read(name);
  if (!document) return tl::unexpected(document.error());
  auto text = signed_text(*document, authority, now_s);
  if (!text)
    return bad(folder.file(name), std::string("is not whole and signed by ") + kPermissionsCa + " beside it",
               kCopyAgain);
  if (text->find(element) == std::string::npos)
    return bad(folder.file(name), "is signed, but another document", kCopyAgain);
  return std::move(*text);
}

/// The text of the first such element at or after `from`; empty if there is none.
std::string element(const std::string& text, const std::string& name, std::size_t from) {
  const std::string opening = '<' + name + '>';
  const std::size_t begin = text.find(opening, from);
  if (begin == std::string::npos) return {};
  const std::size_t end = text.find("</" + name + '>', begin);
  if (end == std::string::npos) return {};
  return text.substr(begin + opening.size(), end - begin - opening.size());
}

std::optional<std::int64_t> read_date(const std::string& text) {
  std::tm parts{};
  const char* const rest = ::strptime(text.c_str(), "%Y-%m-%dT%H:%M:%S", &parts);
  if (rest == nullptr || (*rest != '\0' && *rest != 'Z')) return std::nullopt;  // other zones are left to DDS
  return timegm(&parts);
}

Result<std::int64_t> check_permissions(const std::string& file, const std::string& text,
                                       const std::string& subject, std::int64_t now_s,
                                       const std::string& renew) {
  const std::size_t grant = text.find("<subject_name>" + subject + "</subject_name>");
  if (grant == std::string::npos)
    return bad(file, "are the permissions of another than " + subject, kCopyAgain);
  const auto not_before_s = read_date(element(text, "not_before", grant));
  const auto not_after_s = read_date(element(text, "not_after", grant));
  if (!not_before_s || !not_after_s) return std::int64_t{INT64_MAX};
  if (auto valid = check_time(file, *not_before_s, *not_after_s, now_s, renew); !valid)
    return tl::unexpected(valid.error());
  return *not_after_s;
}

Result<void> check_revoked(const Folder& folder, X509* certificate, X509* authority, std::int64_t now_s) {
  const std::string file = folder.file(kRevoked);
  const auto text = folder.read(kRevoked);
  if (!text) return tl::unexpected(text.error());
  const OwnedCrl list = read_crl(*text);
  if (list == nullptr) return bad(file, "is no whole list of revoked identities", kCopyAgain);
  if (X509_CRL_verify(list.get(), X509_get0_pubkey(authority)) != 1) {
    ERR_clear_error();
    return bad(file, std::string("is not signed by ") + kIdentityCa + " beside it", kCopyAgain);
  }
  const ASN1_TIME* const next = X509_CRL_get0_nextUpdate(list.get());
  if (auto valid = check_time(file, seconds_of(X509_CRL_get0_lastUpdate(list.get())),
                              next != nullptr ? seconds_of(next) : INT64_MAX, now_s,
                              "copy the newest one from where `tandem pki` runs");
      !valid)
    return valid;
  X509_REVOKED* entry = nullptr;
  if (X509_CRL_get0_by_cert(list.get(), &entry, certificate) != 0)
    return bad(folder.file(kCertificate),
               "was revoked on " + date_text(seconds_of(X509_REVOKED_get0_revocationDate(entry))),
               "ask for a new identity (`tandem pki issue`)");
  return {};
}

}  // namespace

Result<Identity> check_identity_folder(const std::string& path, std::int64_t now_s) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error))
    return fail(ErrorCode::kIo, path +
                                    " is no folder that can be read: give the folder of an identity that "
                                    "`tandem pki issue` made");
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0 || (about.st_mode & kOthersWrite) != 0)
    return bad(path, "can be changed by everybody (mode " + mode_text(about.st_mode) + ")",
               "chmod o-w " + path + ", after comparing its files with the original");
  Identity identity;
  identity.folder = std::filesystem::absolute(path, error).lexically_normal().string();
  while (identity.folder.size() > 1 && identity.folder.back() == '/') identity.folder.pop_back();
  const Folder folder(path);

  const auto identity_ca = read_authority(folder, kIdentityCa, now_s);
  if (!identity_ca) return tl::unexpected(identity_ca.error());
  const auto permissions_ca = read_authority(folder, kPermissionsCa, now_s);
  if (!permissions_ca) return tl::unexpected(permissions_ca.error());

  const auto certificate_text = folder.read(kCertificate);
  if (!certificate_text) return tl::unexpected(certificate_text.error());
  const OwnedCertificate certificate = read_certificate(*certificate_text);
  const std::string certificate_file = folder.file(kCertificate);
  if (certificate == nullptr) return bad(certificate_file, "is no whole certificate", kCopyAgain);
  if (X509_verify(certificate.get(), X509_get0_pubkey(identity_ca->get())) != 1) {
    ERR_clear_error();
    return bad(certificate_file, std::string("is not signed by ") + kIdentityCa + " beside it", kCopyAgain);
  }
  identity.name = subject_part(certificate.get(), NID_commonName);
  identity.role = subject_part(certificate.get(), NID_organizationalUnitName);
  const std::string renew = "run `tandem pki renew " + identity.name + "` and copy its folder";
  if (auto valid = check_time(certificate_file, certificate.get(), now_s, renew); !valid)
    return tl::unexpected(valid.error());

  const auto key_text = folder.read(kKey);
  if (!key_text) return tl::unexpected(key_text.error());
  const OwnedKey key = read_key(*key_text);
  if (key == nullptr)
    return bad(folder.file(kKey), "is no whole private key without a passphrase", kCopyAgain);
  const bool belongs = X509_check_private_key(certificate.get(), key.get()) == 1;
  ERR_clear_error();
  if (!belongs)
    return bad(folder.file(kKey), std::string("does not belong to ") + kCertificate + " beside it",
               kCopyAgain);

  X509* const permissions_signer = permissions_ca->get();
  if (auto text = read_document(folder, kGovernance, "<domain_access_rules>", permissions_signer, now_s);
      !text)
    return tl::unexpected(text.error());
  const auto permissions = read_document(folder, kPermissions, "<permissions>", permissions_signer, now_s);
  if (!permissions) return tl::unexpected(permissions.error());
  const auto allowed_until_s =
      check_permissions(folder.file(kPermissions), *permissions, subject_of(certificate.get()), now_s, renew);
  if (!allowed_until_s) return tl::unexpected(allowed_until_s.error());

  identity.not_after_s = std::min(seconds_of(X509_get0_notAfter(certificate.get())), *allowed_until_s);
  for (X509* const authority : {identity_ca->get(), permissions_signer})
    identity.not_after_s = std::min(identity.not_after_s, seconds_of(X509_get0_notAfter(authority)));
  // Without the list a revoked identity would be believed.
  if (auto good = check_revoked(folder, certificate.get(), identity_ca->get(), now_s); !good)
    return tl::unexpected(good.error());
  return identity;
}

}  // namespace tandem::transport::secure
