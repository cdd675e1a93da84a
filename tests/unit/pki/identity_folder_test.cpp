// What `tandem pki` makes is accepted, and everything else is refused in one line that names the file and a
// cure.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "sdk/transport/secure/identity_folder.hpp"
#include "services/credentials/pki/authority.hpp"
#include "tests/support/damage/damage.hpp"

namespace tandem::pki {
namespace {

using testing::HasSubstr;
using testing::Not;
using transport::secure::check_identity_folder;

constexpr std::int64_t kNow = 1'800'000'000;  // 2027-01-15

class IdentityFolder : public testing::Test {
 protected:
  IdentityFolder() {
    std::string pattern = testing::TempDir() + "pkiXXXXXX";
    root_ = ::mkdtemp(pattern.data());
    for (const char* const ca : {"ours", "theirs"}) {
      auto authority = Authority::init(root_ + "/" + ca, kNow);
      EXPECT_TRUE(authority) << authority.error().message;
      EXPECT_TRUE(authority->issue(Role::kServer, "alpha", 30 * kDay, kNow));
      EXPECT_TRUE(authority->issue(Role::kParticipant, "bob", 30 * kDay, kNow));
    }
  }
  ~IdentityFolder() override { std::filesystem::remove_all(root_); }
  IdentityFolder(const IdentityFolder&) = delete;
  IdentityFolder& operator=(const IdentityFolder&) = delete;
  IdentityFolder(IdentityFolder&&) = delete;
  IdentityFolder& operator=(IdentityFolder&&) = delete;

  [[nodiscard]] std::string folder(const std::string& name, const std::string& ca = "ours") const {
    return root_ + "/" + ca + "/" + name;
  }
  [[nodiscard]] std::string file(const std::string& name) const { return folder("bob") + "/" + name; }
  static std::string read(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void write(const std::string& path, const std::string& text) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
  }
  /// What is said of bob's folder; empty: it is good.
  [[nodiscard]] std::string fault(std::int64_t now_s = kNow) const {
    const auto checked = check_identity_folder(folder("bob"), now_s);
    return checked ? std::string() : checked.error().message;
  }
  /// One line with the file and a cure.
  static void expect_line(const std::string& said, const std::string& file, const std::string& cure) {
    EXPECT_THAT(said, HasSubstr(file));
    EXPECT_THAT(said, HasSubstr(cure));
    EXPECT_THAT(said, Not(HasSubstr("\n")));
    EXPECT_THAT(said, Not(HasSubstr("PRIVATE")));
  }

  std::string root_;
};

TEST_F(IdentityFolder, WhatWasIssuedIsGood) {
  const auto bob = check_identity_folder(folder("bob"), kNow);
  ASSERT_TRUE(bob) << bob.error().message;
  EXPECT_EQ(bob->name, "bob");
  EXPECT_EQ(bob->role, "participant");
  EXPECT_EQ(bob->not_after_s, kNow + 30 * kDay);
}

TEST_F(IdentityFolder, KeysAreForTheirOwnerAlone) {
  for (const std::string& key : {file("key.pem"), root_ + "/ours/authority/identity_ca.key",
                                 root_ + "/ours/authority/permissions_ca.key"}) {
    struct stat about {};
    ASSERT_EQ(::stat(key.c_str(), &about), 0) << key;
    EXPECT_EQ(about.st_mode & 0777U, 0600U) << key;
  }
}

TEST_F(IdentityFolder, AKeyThatOthersCanReadIsRefused) {
  for (const mode_t mode : {0644U, 0640U, 0604U}) {
    ASSERT_EQ(::chmod(file("key.pem").c_str(), mode), 0);
    expect_line(fault(), file("key.pem"), "chmod 600");
  }
}

TEST_F(IdentityFolder, AKeyThatSystemdHandsOverMayHaveAnAccessList) {
  ASSERT_EQ(::chmod(file("key.pem").c_str(), 0440), 0);  // as its mask makes it look
  ::setenv("CREDENTIALS_DIRECTORY", folder("alice").c_str(), 1);
  expect_line(fault(), file("key.pem"), "chmod 600");
  ::setenv("CREDENTIALS_DIRECTORY", folder("bob").c_str(), 1);
  EXPECT_EQ(fault(), "");
  ASSERT_EQ(::chmod(file("key.pem").c_str(), 0444), 0);
  expect_line(fault(), file("key.pem"), "chmod 600");
  ::unsetenv("CREDENTIALS_DIRECTORY");
}

TEST_F(IdentityFolder, AFileThatEverybodyCanChangeIsRefused) {
  ASSERT_EQ(::chmod(file("identity_ca.pem").c_str(), 0646), 0);
  expect_line(fault(), file("identity_ca.pem"), "chmod o-w");
}

// Whoever can write the folder can put other files there, or take the list of revoked identities away.
TEST_F(IdentityFolder, AFolderThatEverybodyCanChangeIsRefused) {
  for (const mode_t mode : {0777U, 01777U, 0702U}) {
    ASSERT_EQ(::chmod(folder("bob").c_str(), mode), 0);
    expect_line(fault(), folder("bob"), "chmod o-w");
  }
  ASSERT_EQ(::chmod(folder("bob").c_str(), 0755), 0);
  EXPECT_EQ(fault(), "");
}

TEST_F(IdentityFolder, AKeyOfAnAuthorityThatOthersCanReadIsRefused) {
  for (const char* const name : {"identity_ca.key", "permissions_ca.key"}) {
    const std::string key = root_ + "/ours/authority/" + name;
    ASSERT_EQ(::chmod(key.c_str(), 0644), 0);
    const auto opened = Authority::open(root_ + "/ours");
    ASSERT_FALSE(opened);
    expect_line(opened.error().message, key, "chmod 600");
    ASSERT_EQ(::chmod(key.c_str(), 0600), 0);
  }
  EXPECT_TRUE(Authority::open(root_ + "/ours"));
}

TEST_F(IdentityFolder, AuthoritiesAreNotMadeWhereOthersCanWrite) {
  const std::string open = root_ + "/open";
  ASSERT_EQ(::mkdir(open.c_str(), 0700), 0);
  ASSERT_EQ(::chmod(open.c_str(), 0777), 0);
  const auto made = Authority::init(open, kNow);
  ASSERT_FALSE(made);
  expect_line(made.error().message, open, "chmod");
  ASSERT_EQ(::symlink((root_ + "/nowhere").c_str(), (root_ + "/link").c_str()), 0);
  EXPECT_FALSE(Authority::init(root_ + "/link", kNow));
}

constexpr std::array<const char*, 7> kFiles{"identity_ca.pem", "permissions_ca.pem", "identity.pem",
                                            "key.pem",         "governance.p7s",     "permissions.p7s",
                                            "crl.pem"};

TEST_F(IdentityFolder, EveryFileThatIsDamagedIsRefusedByName) {
  std::vector<std::string> files;
  for (const char* const name : kFiles) files.push_back(file(name));
  damage_each(files, [this](const std::string& path, const Damage& damage) {
    SCOPED_TRACE(path + " is " + damage.name);
    expect_line(fault(), path, damage.name == "unreadable" ? "chown" : "copy the whole folder");
  });
  EXPECT_EQ(fault(), "");
}

// A revoked identity would be believed without it, and by whom it was taken away is not known.
TEST_F(IdentityFolder, ARevokedIdentityIsNotGoodWithoutTheList) {
  auto ours = Authority::open(root_ + "/ours");
  ASSERT_TRUE(ours->revoke("bob", kNow));
  std::filesystem::remove(file("crl.pem"));
  expect_line(fault(), file("crl.pem"), "copy the whole folder");
}

TEST_F(IdentityFolder, EveryFileThatIsCutShortIsNamed) {
  for (const char* const name : kFiles) {
    const std::string text = read(file(name));
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, text.size() / 2, text.size() - 40}) {
      write(file(name), text.substr(0, size));
      expect_line(fault(), file(name), "copy the whole folder");
    }
    write(file(name), text);
    EXPECT_EQ(fault(), "");
  }
}

TEST_F(IdentityFolder, EveryFileOfAnotherAuthorityIsRefused) {
  for (const char* const name : kFiles) {
    const std::string text = read(file(name));
    write(file(name), read(folder("bob", "theirs") + "/" + name));
    expect_line(fault(), folder("bob"), "copy the whole folder");
    write(file(name), text);
  }
  EXPECT_EQ(fault(), "");
}

TEST_F(IdentityFolder, FilesOfAnotherIdentityAreRefused) {
  for (const char* const name : {"identity.pem", "key.pem", "permissions.p7s"}) {
    const std::string text = read(file(name));
    write(file(name), read(folder("alpha") + "/" + name));
    expect_line(fault(), folder("bob"), "copy the whole folder");
    write(file(name), text);
  }
}

TEST_F(IdentityFolder, SignedDocumentsThatAreSwappedOrChangedAreRefused) {
  const std::string governance = read(file("governance.p7s")), permissions = read(file("permissions.p7s"));
  write(file("governance.p7s"), permissions);
  expect_line(fault(), file("governance.p7s"), "another document");
  write(file("governance.p7s"), governance);
  write(file("permissions.p7s"), governance);
  expect_line(fault(), file("permissions.p7s"), "another document");
  std::string more = permissions;
  more.replace(more.find("TandemInput"), 11, "TandemDelta");
  write(file("permissions.p7s"), more);
  expect_line(fault(), file("permissions.p7s"), "not whole and signed");
}

TEST_F(IdentityFolder, AnExpiredIdentityAndAClockThatIsOffByADayAreNamed) {
  EXPECT_EQ(fault(kNow + 30 * kDay - 1), "");
  expect_line(fault(kNow + 31 * kDay), file("identity.pem"), "tandem pki renew bob");
  expect_line(fault(kNow - kDay), file("identity_ca.pem"), "set the clock");
  expect_line(fault(kNow + kAuthorityDays * kDay + 1), file("identity_ca.pem"), "tandem pki init");
}

TEST_F(IdentityFolder, AListOfRevokedIdentitiesThatIsTooOldIsNamed) {
  const auto authority = [](const std::string& name) {
    return Signer{transport::secure::read_certificate(read(name + ".pem")),
                  transport::secure::read_key(read(name + ".key"))};
  };
  const auto list =
      make_revoked_list(authority(root_ + "/ours/authority/identity_ca"), {}, {kNow - kDay, kNow + kDay});
  ASSERT_TRUE(list);
  write(file("crl.pem"), *list);
  EXPECT_EQ(fault(), "");
  expect_line(fault(kNow + 2 * kDay), file("crl.pem"), "copy the newest one");
}

TEST_F(IdentityFolder, AMegabyteOrNoFileIsRefused) {
  write(file("identity.pem"), std::string(2 << 20, 'x'));
  expect_line(fault(), file("identity.pem"), "copy the whole folder");
  std::filesystem::remove(file("identity.pem"));
  ASSERT_EQ(::mkfifo(file("identity.pem").c_str(), 0600), 0);
  expect_line(fault(), file("identity.pem"), "copy the whole folder");
  EXPECT_FALSE(check_identity_folder(root_ + "/nowhere", kNow));
}

TEST_F(IdentityFolder, ARevokedIdentityIsRefusedAndARenewedOneIsGood) {
  auto ours = Authority::open(root_ + "/ours");
  ASSERT_TRUE(ours);
  ASSERT_TRUE(ours->revoke("bob", kNow));
  expect_line(fault(), file("identity.pem"), "revoked");
  EXPECT_TRUE(check_identity_folder(folder("alpha"), kNow));
  ASSERT_TRUE(ours->renew("bob", std::nullopt, kNow));
  EXPECT_EQ(fault(), "");
  EXPECT_EQ(ours->register_of().size(), 3U);
}

TEST_F(IdentityFolder, AuthoritiesAreMadeOnceAndNamesAreChecked) {
  EXPECT_EQ(Authority::init(root_ + "/ours", kNow).error().code, ErrorCode::kConflict);
  auto ours = Authority::open(root_ + "/ours");
  ASSERT_TRUE(ours);
  EXPECT_EQ(Authority::open(root_ + "/ours").error().code, ErrorCode::kConflict);  // while it is held
  EXPECT_EQ(ours->issue(Role::kServer, "bob", kDay, kNow).error().code, ErrorCode::kConflict);
  for (const char* const name : {"", "..", "a/b", "authority", "-x", "a,OU=server"})
    EXPECT_EQ(ours->issue(Role::kServer, name, kDay, kNow).error().code, ErrorCode::kInvalidArgument) << name;
  EXPECT_FALSE(ours->revoke("nobody", kNow));
  EXPECT_FALSE(ours->renew("nobody", std::nullopt, kNow));
}

}  // namespace
}  // namespace tandem::pki
