#include "services/audience/folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "services/audience/object_name.hpp"

namespace tandem::audience {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class AudienceFolderTest : public ::testing::Test {
 protected:
  ~AudienceFolderTest() override { fs::remove_all(root); }
  static std::span<const std::byte> bytes(const std::string& text) { return std::as_bytes(std::span(text)); }
  std::string read(const std::string& path) const {
    std::ostringstream out;
    out << std::ifstream(root / path).rdbuf();
    return out.str();
  }

  const fs::path root = fs::temp_directory_path() / ("audience-" + std::to_string(::getpid()));
};

TEST_F(AudienceFolderTest, AnObjectIsNamedByItsSha256) {
  const std::string text = "abc";
  EXPECT_EQ(name_of(bytes(text), ObjectKind::kMessages).path(),
            "objects/ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad.bin");
}

TEST_F(AudienceFolderTest, AFileIsReplacedAsAWhole) {
  auto folder = Folder::open(root / "new" / "folder");
  ASSERT_TRUE(folder);
  ASSERT_TRUE(folder->put("manifest.json", bytes("one")));
  std::ifstream held(root / "new/folder/manifest.json");
  ASSERT_TRUE(folder->put("manifest.json", bytes("two, longer")));
  std::string seen;
  std::getline(held, seen);
  EXPECT_EQ(seen, "one") << "who reads the old one reads it whole";
  EXPECT_EQ(read("new/folder/manifest.json"), "two, longer");
  EXPECT_FALSE(fs::exists(root / "new/folder/manifest.json.part"));
}

TEST_F(AudienceFolderTest, OnlyOneWriterHasIt) {
  const auto first = Folder::open(root);
  ASSERT_TRUE(first);
  const auto second = Folder::open(root);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kConflict);
  EXPECT_THAT(second.error().message, HasSubstr("is writing there"));
}

TEST_F(AudienceFolderTest, WhatAnOlderWriterLeftGoesAndNothingElse) {
  const std::string old = name_of(bytes("old"), ObjectKind::kMessages).path();
  const std::string kept = name_of(bytes("kept"), ObjectKind::kMessages).path();
  {
    auto folder = Folder::open(root);
    ASSERT_TRUE(folder && folder->put(old, bytes("old")) && folder->put(kept, bytes("kept")));
  }
  std::ofstream(root / (old + ".part")) << "cut sh";
  std::ofstream(root / "objects" / "notes.txt") << "a user's own";
  std::ofstream(root / "index.html") << "a user's own";
  auto folder = Folder::open(root);
  ASSERT_TRUE(folder && folder->put(kept, bytes("kept")));
  EXPECT_TRUE(fs::exists(root / old)) << "until it is told to";
  folder->remove_leftovers();
  EXPECT_FALSE(fs::exists(root / old));
  EXPECT_FALSE(fs::exists(root / (old + ".part")));
  EXPECT_TRUE(fs::exists(root / kept));
  EXPECT_TRUE(fs::exists(root / "objects" / "notes.txt"));
  EXPECT_TRUE(fs::exists(root / "index.html"));
}

TEST_F(AudienceFolderTest, WhatIsNoFolderIsRefusedByName) {
  std::ofstream(root) << "a file";
  const auto folder = Folder::open(root);
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().message, HasSubstr(root.string()));
}

}  // namespace
}  // namespace tandem::audience
