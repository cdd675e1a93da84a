// The files of a connection to NATS.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

#include "sdk/transport/nats/nats_bus.hpp"
#include "tests/support/damage/damage.hpp"

namespace tandem::transport {
namespace {

class NatsFiles : public ::testing::Test {
 protected:
  NatsFiles() {
    std::ofstream(user) << "-----BEGIN NATS USER JWT-----\neyJ0\n------END NATS USER JWT------\n\n"
                           "-----BEGIN USER NKEY SEED-----\nSUAB\n------END USER NKEY SEED------\n";
    chmod(user.c_str(), 0600);
    std::ofstream(authorities) << "# ours, and as long a word on it as the rest of the file\n"
                                  "-----BEGIN CERTIFICATE-----\nMIIB\n-----END CERTIFICATE-----\n";
  }
  ~NatsFiles() override {
    std::remove(user.c_str());
    std::remove(authorities.c_str());
  }
  [[nodiscard]] std::string fault(const std::string& url = "tls://hub") const {
    const auto good =
        check_nats_files({.url = url, .name = "test", .credentials = user, .tls_ca = authorities});
    return good ? "" : good.error().message;
  }
  const std::string user = ::testing::TempDir() + "nats-" + std::to_string(getpid()) + ".creds";
  const std::string authorities = user + ".ca";
};

TEST_F(NatsFiles, EachOneThatIsDamagedIsRefusedByName) {
  ASSERT_EQ(fault(), "");
  damage_each({user, authorities}, [this](const std::string& path, const Damage& damage) {
    EXPECT_NE(fault().find(path + " "), std::string::npos) << path << " is " << damage.name;
    EXPECT_NE(fault().find(": give "), std::string::npos) << fault();
  });
  std::ofstream(user) << std::ifstream(authorities).rdbuf();
  EXPECT_NE(fault().find("no NATS user"), std::string::npos) << "of another kind";
}

TEST_F(NatsFiles, AUserWhomEverybodyCanReadIsRefused) {
  chmod(user.c_str(), 0644);
  EXPECT_NE(fault().find("chmod 600 " + user), std::string::npos);
}

// libnats would connect without TLS.
TEST_F(NatsFiles, AuthoritiesForAConnectionWithoutTlsAreRefused) {
  EXPECT_NE(fault("nats://hub").find("tls://"), std::string::npos);
}

TEST(NatsAddress, WithoutTlsToAnotherMachineIsWarnedOf) {
  EXPECT_EQ(warning_without_tls(""), "");
  EXPECT_EQ(warning_without_tls("tls://hub.example"), "");
  EXPECT_EQ(warning_without_tls("nats://127.0.0.1:4222"), "");
  EXPECT_EQ(warning_without_tls("nats://a:b@localhost:4222,nats://[::1]"), "");
  const std::string said = warning_without_tls("nats://localhost,nats://north:secret@hub.example");
  EXPECT_NE(said.find("without TLS"), std::string::npos);
  EXPECT_EQ(said.find("secret"), std::string::npos);
}

}  // namespace
}  // namespace tandem::transport
