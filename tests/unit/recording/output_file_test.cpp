#include "services/follow/recording/output_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace tandem::recording {
namespace {

namespace fs = std::filesystem;

class OutputFileTest : public ::testing::Test {
 protected:
  OutputFileTest() { fs::create_directories(folder); }
  ~OutputFileTest() override { fs::remove_all(folder); }

  [[nodiscard]] std::string path(const std::string& name) const { return folder / name; }
  [[nodiscard]] std::string content(const std::string& name) const {
    std::ifstream file(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void put(const std::string& name, const std::string& text) const { std::ofstream(path(name)) << text; }
  static Result<void> write(OutputFile& file, const std::string& text) {
    return file.write(std::as_bytes(std::span(text)));
  }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
  }

  const fs::path folder = fs::temp_directory_path() / ("output-" + std::to_string(::getpid()));
};

TEST_F(OutputFileTest, ReplacesAFileOnlyWhenItIsComplete) {
  put("x", "old");
  {
    auto file = OutputFile::create(path("x"), Existing::kReplaced);
    ASSERT_TRUE(file) << file.error().message;
    ASSERT_TRUE(write(*file, "new"));
    EXPECT_EQ(content("x"), "old");
  }
  EXPECT_EQ(content("x"), "old");
  EXPECT_EQ(files(), 1U);
  auto file = OutputFile::create(path("x"), Existing::kReplaced);
  ASSERT_TRUE(file && write(*file, "new"));
  EXPECT_EQ(file->written_bytes(), 3U);
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(content("x"), "new");
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutputFileTest, AFileThatHoldsSomethingStaysAndTheNewOneGetsTheNextNumber) {
  put("run.1.mcap", "first");
  for (const char* number : {"-2", "-3"}) {
    auto file = OutputFile::create(path("run.1.mcap"), Existing::kStays);
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_TRUE(file->is_numbered());
    EXPECT_EQ(file->path(), path(std::string("run.1") + number + ".mcap"));
    ASSERT_TRUE(write(*file, number) && file->commit());
  }
  EXPECT_EQ(content("run.1.mcap"), "first");
  EXPECT_EQ(content("run.1-2.mcap"), "-2");
  EXPECT_EQ(content("run.1-3.mcap"), "-3");
  fs::remove(path("run.1-2.mcap"));
  const auto free = OutputFile::create(path("run.1.mcap"), Existing::kStays);
  ASSERT_TRUE(free);
  EXPECT_EQ(free->path(), path("run.1-2.mcap")) << "the first that is free";
}

TEST_F(OutputFileTest, AnEmptyFileHasNothingToLose) {
  put("x", "");
  auto file = OutputFile::create(path("x"), Existing::kStays);
  ASSERT_TRUE(file && write(*file, "new") && file->commit());
  EXPECT_FALSE(file->is_numbered());
  EXPECT_EQ(content("x"), "new");
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutputFileTest, ALinksTargetStaysAndTheNewFileStandsBesideIt) {
  fs::create_directory(folder / "disk");
  put("disk/x", "old");
  fs::create_symlink("disk/x", path("link"));
  auto file = OutputFile::create(path("link"), Existing::kStays);
  ASSERT_TRUE(file && write(*file, "new") && file->commit());
  EXPECT_EQ(content("link"), "old");
  EXPECT_EQ(content("disk/x-2"), "new");
}

TEST_F(OutputFileTest, AFileThatComesToBeMeanwhileStaysToo) {
  auto file = OutputFile::create(path("x.npy"), Existing::kStays);
  ASSERT_TRUE(file && write(*file, "mine"));
  put("x.npy", "another's");
  put("x-2.npy", "a third's");
  ASSERT_TRUE(file->take_name());
  EXPECT_EQ(file->path(), path("x-3.npy"));
  EXPECT_EQ(content("x.npy"), "another's");
  EXPECT_EQ(content("x-2.npy"), "a third's");
  EXPECT_EQ(content("x-3.npy"), "mine");
  EXPECT_EQ(files(), 3U) << "no .part";
}

TEST_F(OutputFileTest, WhoWritesANumberedFileIsNamedToTheNext) {
  put("x", "old");
  auto second = OutputFile::create(path("x"), Existing::kStays);
  ASSERT_TRUE(second && write(*second, "goes on"));
  for (const bool named : {false, true}) {
    if (named) {
      ASSERT_TRUE(second->take_name());
    }
    const auto third = OutputFile::create(path("x"), Existing::kStays);
    ASSERT_FALSE(third) << named;
    EXPECT_NE(third.error().message.find("x-2: cannot create: process"), std::string::npos)
        << third.error().message;
  }
}

TEST_F(OutputFileTest, WhoReadsTheOldFileKeepsIt) {
  put("x", "old");
  std::ifstream reader(path("x"));
  auto file = OutputFile::create(path("x"), Existing::kReplaced);
  ASSERT_TRUE(file && file->take_name());
  ASSERT_TRUE(write(*file, "newer"));
  EXPECT_EQ(content("x"), "newer") << "written on under its name";
  EXPECT_EQ((std::string(std::istreambuf_iterator<char>(reader), {})), "old");
}

TEST_F(OutputFileTest, ALinkStaysALink) {
  fs::create_directory(folder / "there");
  put("there/x", "old");
  fs::create_symlink("there/x", path("link"));
  fs::create_symlink("link", path("chain"));
  fs::create_symlink("there/y", path("dangling"));
  for (const char* name : {"chain", "dangling"}) {
    auto file = OutputFile::create(path(name), Existing::kReplaced);
    ASSERT_TRUE(file && write(*file, "new") && file->commit());
    EXPECT_TRUE(fs::is_symlink(path(name)));
    EXPECT_EQ(content(name), "new");
  }
  EXPECT_EQ(content("there/x"), "new");
  EXPECT_TRUE(fs::is_symlink(path("link")));
}

TEST_F(OutputFileTest, WhatIsNoRegularFileIsRefusedAndStays) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  fs::create_symlink("pipe", path("link"));
  fs::create_symlink("circle", path("circle"));
  fs::create_directory(folder / "folder");
  for (const char* name : {"pipe", "link", "folder", "circle", "nowhere/x"}) {
    const auto file = OutputFile::create(path(name), Existing::kReplaced);
    ASSERT_FALSE(file) << name;
    EXPECT_EQ(file.error().code, ErrorCode::kIo);
    EXPECT_EQ(file.error().message.find(path(name)), 0U) << file.error().message;
  }
  EXPECT_TRUE(fs::is_fifo(path("pipe")));
  EXPECT_EQ(files(), 4U);
}

TEST_F(OutputFileTest, OneWritesAFileAndAnotherIsToldWhoDoes) {
  fs::create_directory(folder / "there");
  fs::create_directory_symlink("there", path("way"));
  fs::create_symlink("there/x", path("link"));
  const std::string holder = "process " + std::to_string(::getpid()) + " is writing it";
  auto first = OutputFile::create(path("there/x"), Existing::kStays);
  ASSERT_TRUE(first) << first.error().message;
  ASSERT_TRUE(write(*first, "first"));
  for (const bool named : {false, true}) {
    if (named) {
      ASSERT_TRUE(first->take_name());
    }
    for (const char* spelling : {"there/x", "./there/../there//x", "way/x", "link"}) {
      const auto second =
          OutputFile::create(path(spelling), spelling[0] == 'w' ? Existing::kReplaced : Existing::kStays);
      ASSERT_FALSE(second) << spelling << (named ? " with its name" : " as .part");
      EXPECT_EQ(second.error().code, ErrorCode::kConflict);
      EXPECT_NE(second.error().message.find(holder), std::string::npos) << second.error().message;
    }
  }
  EXPECT_FALSE(fs::exists(path("there/x.part")));
  ASSERT_TRUE(write(*first, " goes on") && first->commit());
  EXPECT_EQ(content("there/x"), "first goes on");
  auto later = OutputFile::create(path("link"), Existing::kReplaced);
  EXPECT_TRUE(later) << later.error().message;
}

TEST_F(OutputFileTest, WhatAKilledRunLeftIsReplacedAndNotWrittenTo) {
  put("x.part", "left");
  fs::create_hard_link(path("x.part"), path("kept"));
  auto file = OutputFile::create(path("x"), Existing::kReplaced);
  ASSERT_TRUE(file && write(*file, "new") && file->commit());
  EXPECT_EQ(content("x"), "new");
  EXPECT_EQ(content("kept"), "left");
  EXPECT_EQ(files(), 2U);
}

TEST_F(OutputFileTest, ThePartOfAnotherIsNeitherRenamedNorRemoved) {
  {
    auto file = OutputFile::create(path("x"), Existing::kReplaced);
    ASSERT_TRUE(file && write(*file, "mine"));
    fs::remove(path("x.part"));
    put("x.part", "another's");
    const auto named = file->take_name();
    ASSERT_FALSE(named);
    EXPECT_NE(named.error().message.find("x.part is another file by now"), std::string::npos)
        << named.error().message;
  }
  EXPECT_EQ(content("x.part"), "another's");
  EXPECT_FALSE(fs::exists(path("x")));
}

TEST_F(OutputFileTest, AFileThatWasRemovedWhileItWasWrittenIsAnError) {
  auto file = OutputFile::create(path("x"), Existing::kReplaced);
  ASSERT_TRUE(file && file->take_name() && write(*file, "gone"));
  fs::remove(path("x"));
  const auto closed = file->close();
  ASSERT_FALSE(closed);
  EXPECT_NE(closed.error().message.find("was removed while it was written"), std::string::npos);
}

TEST_F(OutputFileTest, AFileThatWasMovedAwayIsComplete) {
  auto file = OutputFile::create(path("x"), Existing::kReplaced);
  ASSERT_TRUE(file && file->take_name());
  fs::rename(path("x"), path("y"));
  ASSERT_TRUE(write(*file, "all") && file->close());
  EXPECT_EQ(content("y"), "all");
}

}  // namespace
}  // namespace tandem::recording
