#include "services/gateway/entrance/certificate.hpp"

#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "services/gateway/entrance/admission.hpp"
#include "services/program/process/credential.hpp"
#include "tests/support/damage/damage.hpp"

namespace tandem::gateway {
namespace {

class CertificateTest : public ::testing::Test {
 protected:
  CertificateTest() { make(cert, key); }
  ~CertificateTest() override {
    for (const std::string& file : {cert, key, other_cert, other_key}) std::remove(file.c_str());
  }
  /// Holds from now on for an hour.
  static void make(const std::string& cert_path, const std::string& key_path) {
    EVP_PKEY* const pair = EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519");
    X509* const made = X509_new();
    ASN1_INTEGER_set(X509_get_serialNumber(made), 1);
    X509_gmtime_adj(X509_getm_notBefore(made), 0);
    X509_gmtime_adj(X509_getm_notAfter(made), 3600);
    X509_set_pubkey(made, pair);
    X509_sign(made, pair, nullptr);
    FILE* file = std::fopen(cert_path.c_str(), "w");
    PEM_write_X509(file, made);
    std::fclose(file);
    file = std::fopen(key_path.c_str(), "w");
    PEM_write_PrivateKey(file, pair, nullptr, nullptr, 0, nullptr, nullptr);
    std::fclose(file);
    chmod(key_path.c_str(), 0600);
    X509_free(made);
    EVP_PKEY_free(pair);
  }
  [[nodiscard]] std::string refusal(std::int64_t at_s) const {
    const auto read = Certificate::read(cert, key, at_s);
    EXPECT_FALSE(read);
    return read ? "" : read.error().message;
  }
  [[nodiscard]] static bool says(const std::string& message, const std::string& file, const char* what) {
    return message.find(file) != std::string::npos && message.find(what) != std::string::npos;
  }

  const std::int64_t now_s = std::time(nullptr) + 60;
  const std::string stem = ::testing::TempDir() + "certificate-" + std::to_string(getpid());
  const std::string cert = stem + ".crt", key = stem + ".key";
  const std::string other_cert = stem + ".other.crt", other_key = stem + ".other.key";
};

TEST_F(CertificateTest, ThatIsGoodIsUsed) {
  const auto read = Certificate::read(cert, key, now_s);
  ASSERT_TRUE(read) << read.error().message;
  SSL_CTX* const context = SSL_CTX_new(TLS_server_method());
  EXPECT_TRUE(read->use(context));
  SSL_CTX_free(context);
}

TEST_F(CertificateTest, ThatIsOverOrNotYetBegunIsRefused) {
  EXPECT_TRUE(says(refusal(now_s + 7200), cert, "expired on"));
  EXPECT_TRUE(says(refusal(now_s - 86'400), cert, "holds from"));
}

TEST_F(CertificateTest, OfAnotherKeyIsRefused) {
  make(other_cert, other_key);
  std::rename(other_key.c_str(), key.c_str());
  EXPECT_TRUE(says(refusal(now_s), cert, "do not belong together"));
}

TEST_F(CertificateTest, WithAKeyThatEverybodyCanReadIsRefused) {
  chmod(key.c_str(), 0644);
  EXPECT_TRUE(says(refusal(now_s), key, "chmod 600"));
}

// Nothing of it may open the door wider, or end with a connection that is not encrypted.
TEST_F(CertificateTest, EachFileOfAGatewayThatIsDamagedIsRefusedByName) {
  const std::string token = stem + ".token", secret = stem + ".secret", open = secret + ".pub";
  std::ofstream(token) << "0123456789abcdef0123456789abcdef\n";
  ASSERT_TRUE(tokens::SecretKey::make()->write(secret));
  const auto fault = [&]() -> std::string {
    if (const auto secrets = read_secrets(token, {open}); !secrets) return secrets.error().message;
    const auto read = Certificate::read(cert, key, now_s);
    return read ? "" : read.error().message;
  };
  ASSERT_EQ(fault(), "");
  damage_each({token, open, cert, key}, [&](const std::string& path, const Damage& damage) {
    // Half of a token is a token, which nobody has.
    if (path == token && damage.name == "cut short") return;
    EXPECT_TRUE(says(fault(), path, ": ")) << path << " is " << damage.name << ", and is said: " << fault();
  });
  EXPECT_EQ(fault(), "");
  for (const std::string& file : {token, secret, open}) std::remove(file.c_str());
}

// systemd hands nothing over where a file is not there; what is there and cannot be read is refused later.
TEST_F(CertificateTest, ACredentialIsMissingOnlyIfNothingOfItsNameIsThere) {
  const std::string folder = stem + ".credentials";
  std::filesystem::create_directory(folder);
  ::setenv("CREDENTIALS_DIRECTORY", folder.c_str(), 1);
  EXPECT_EQ(credential("token"), "");
  std::filesystem::create_symlink(folder + "/nowhere", folder + "/token");
  EXPECT_EQ(credential("token"), folder + "/token");
  ::unsetenv("CREDENTIALS_DIRECTORY");
  EXPECT_EQ(credential("token"), "");
  std::filesystem::remove_all(folder);
}

TEST_F(CertificateTest, CutShortIsRefused) {
  for (const std::string& path : {cert, key}) {
    std::ifstream in(path);
    const std::string whole{std::istreambuf_iterator<char>(in), {}};
    for (const std::size_t size : {std::size_t{0}, std::size_t{20}, whole.size() / 2, whole.size() - 8}) {
      std::ofstream(path) << whole.substr(0, size);
      EXPECT_TRUE(says(refusal(now_s), path, "cut short")) << path << ' ' << size;
    }
    std::ofstream(path) << whole;
  }
  EXPECT_TRUE(Certificate::read(cert, key, now_s));
  // A good one in front of half of the next.
  std::ifstream in(cert);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  std::ofstream(cert) << whole << whole.substr(0, whole.size() / 2);
  EXPECT_TRUE(says(refusal(now_s), cert, "cut short"));
}

}  // namespace
}  // namespace tandem::gateway
