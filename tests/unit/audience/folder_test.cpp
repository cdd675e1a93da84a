#include "services/follow/audience/folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "services/follow/audience/object_name.hpp"
#include "services/follow/audience/publication.hpp"
#include "tests/support/client/fake_server.hpp"

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

TEST_F(AudienceFolderTest, WhatStandsThereIsRead) {
  auto folder = Folder::open(root);
  ASSERT_TRUE(folder);
  auto held = folder->read("manifest.json");
  ASSERT_TRUE(held);
  EXPECT_FALSE(*held) << "none is there";
  ASSERT_TRUE(folder->put("manifest.json", bytes("text")));
  held = folder->read("manifest.json");
  ASSERT_TRUE(held && *held);
  EXPECT_EQ(**held, "text");
  EXPECT_FALSE(folder->read("objects"));
}

TEST_F(AudienceFolderTest, ARestartLeavesTheEarlierPublicationAndTheNextOneGoesOn) {
  client::FakeServer server;
  client::Now now{1'000'000'000, 1'700'000'000'000'000'000};
  const auto publish = [&](bool anew) {
    const auto publication = Publication::open(root, {.began_ms = 5}, anew);
    EXPECT_TRUE(publication) << publication.error().message;
    transport::SessionMessage session = server.session;
    Writer& writer = (*publication)->writer();
    writer.add(session);
    writer.add_snapshot(server.frame(), server.snapshot().bytes);
    for (int i = 0; i < 40; ++i) {
      const auto delta = server.advance(now.wall_ns);
      now.steady_ns += client::kFrameNs;
      now.wall_ns += client::kFrameNs;
      writer.add(server.session.epoch,
                 {delta.frame, delta.last_input, delta.server_time_ns, delta.hash, delta.payload},
                 now.steady_ns);
      (*publication)->turned(now);
    }
    EXPECT_TRUE((*publication)->finish(now));
    return std::pair(read_manifest(read("manifest.json")), (*publication)->told());
  };
  const auto files = [this] {
    return std::distance(fs::directory_iterator(root / "objects"), fs::directory_iterator());
  };
  const auto [first, nothing] = publish(false);
  const auto of_one = files();
  EXPECT_EQ(nothing, "");
  const auto [second, told] = publish(false);
  ASSERT_TRUE(first && second);
  EXPECT_THAT(told, HasSubstr("goes on behind the 1 s that are there"));
  EXPECT_EQ(second->passages.size(), 2U);
  EXPECT_EQ(second->passages[0].snapshot, first->passages[0].snapshot);
  EXPECT_GE(files(), 2 * of_one - 1) << "all objects of both; the session may be one";
  std::ofstream(root / "manifest.json") << "{ cut sh";
  const auto [third, warned] = publish(false);
  EXPECT_THAT(warned, HasSubstr("manifest.json cannot be read"));
  EXPECT_GT(files(), 2 * of_one) << "what belongs to it stays, too";
  const auto [anew, silent] = publish(true);
  ASSERT_TRUE(anew);
  EXPECT_EQ(silent, "");
  EXPECT_EQ(anew->passages.size(), 1U);
  EXPECT_EQ(files(), of_one);
  std::ofstream(root / "manifest.json") << R"({"format":"tandem-audience","version":9})";
  const auto newer = Publication::open(root, {}, false);
  ASSERT_FALSE(newer);
  EXPECT_THAT(newer.error().message, HasSubstr("manifest.json: it is of another version than 1"));
}

TEST_F(AudienceFolderTest, WhatIsNoFolderIsRefusedByName) {
  std::ofstream(root) << "a file";
  const auto folder = Folder::open(root);
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().message, HasSubstr(root.string()));
}

}  // namespace
}  // namespace tandem::audience
