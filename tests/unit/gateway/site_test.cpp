#include "services/gateway/site.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace tandem::gateway {
namespace {

namespace fs = std::filesystem;

class SiteTest : public ::testing::Test {
 protected:
  SiteTest() {
    fs::remove_all(root);
    fs::create_directories(root / "assets");
    fs::create_directories(root / ".git");
    write("index.html", "<p>");
    write("assets/app-1a2b.js", std::string(10'000, 'x'));
    write(".git/config", "secret");
    write(".env", "secret");
    fs::create_symlink("/etc/passwd", root / "link.txt");
  }
  ~SiteTest() override { fs::remove_all(root); }
  SiteTest(const SiteTest&) = delete;
  SiteTest& operator=(const SiteTest&) = delete;
  SiteTest(SiteTest&&) = delete;
  SiteTest& operator=(SiteTest&&) = delete;

  void write(const std::string& name, const std::string& text) const { std::ofstream(root / name) << text; }

  fs::path root = fs::path(::testing::TempDir()) / "gateway-site";
};

TEST_F(SiteTest, ServesFilesWithTheirTypes) {
  const auto site = Site::load(root.string());
  ASSERT_TRUE(site) << site.error().message;
  ASSERT_NE(site->find("/"), nullptr);
  EXPECT_EQ(site->find("/")->bytes, "<p>");
  EXPECT_EQ(site->find("/")->type, "text/html; charset=utf-8");
  EXPECT_FALSE(site->find("/")->immutable);
  const Site::File* script = site->find("/assets/app-1a2b.js");
  ASSERT_NE(script, nullptr);
  EXPECT_EQ(script->type, "text/javascript; charset=utf-8");
  EXPECT_TRUE(script->immutable);
  EXPECT_LT(script->gzip.size(), 100U);
  EXPECT_EQ(script->gzip.substr(0, 2), "\x1f\x8b");
  EXPECT_EQ(media_type("x.wasm"), "application/wasm");
  EXPECT_EQ(media_type("x"), "application/octet-stream");
}

TEST_F(SiteTest, FilesThatTheBuildPackedForOtherServersAreLeftOut) {
  write("assets/app-1a2b.js.gz", "packed");
  const auto site = Site::load(root.string());
  ASSERT_TRUE(site);
  EXPECT_EQ(site->find("/assets/app-1a2b.js.gz"), nullptr);
  EXPECT_NE(site->find("/assets/app-1a2b.js"), nullptr);
}

TEST_F(SiteTest, NoPathLeadsAnywhereElse) {
  const auto site = Site::load(root.string());
  ASSERT_TRUE(site);
  for (const char* path : {"", "index.html", "/../index.html", "/assets", "/assets/", "/.env", "/.git/config",
                           "/link.txt", "//index.html", "/assets/../index.html", "/etc/passwd"})
    EXPECT_EQ(site->find(path), nullptr) << path;
}

TEST_F(SiteTest, AFolderWithoutAPageIsRefused) {
  EXPECT_EQ(Site::load((root / "assets").string()).error().code, ErrorCode::kIo);
  EXPECT_EQ(Site::load((root / "missing").string()).error().code, ErrorCode::kIo);
}

}  // namespace
}  // namespace tandem::gateway
