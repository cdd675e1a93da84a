#include "services/host/checkpoint/folder.hpp"

#include <gtest/gtest.h>

#include <string>

#include "services/host/checkpoint/format.hpp"
#include "services/host/checkpoint/writer.hpp"
#include "tests/support/disk/simulated_disk.hpp"
#include "tests/unit/checkpoint/sample.hpp"

namespace tandem::checkpoint {
namespace {

constexpr Epoch kEpoch = 1'700'000'000'000;

Result<void> store(Folder& folder, Frame frame, Epoch epoch = kEpoch) {
  std::vector<std::byte> bytes;
  if (auto made = encode(sample(epoch, frame), bytes); !made) return made;
  return folder.store({epoch, frame}, bytes);
}

Folder::Found newest(Disk& disk) {
  Folder folder(disk);
  auto found = folder.newest([](const Checkpoint&) { return Result<void>(); });
  EXPECT_TRUE(found);
  return std::move(*found);
}

std::vector<std::string> names_of(Disk& disk) { return std::move(*disk.list()); }

Frame newest_frame(Disk& disk) {
  const auto found = newest(disk);
  return found.checkpoint ? found.checkpoint->frame : 0;
}

TEST(Folder, TheNewestIsFoundAndThreeAreKept) {
  SimulatedDisk disk;
  Folder folder(disk);
  for (Frame frame = 30; frame <= 300; frame += 30) ASSERT_TRUE(store(folder, frame));
  EXPECT_EQ(disk.list()->size(), Folder::kKept);
  EXPECT_EQ(newest_frame(disk), 300U);
  const auto found = newest(disk);
  EXPECT_EQ(found.newest_epoch, kEpoch);
  EXPECT_TRUE(found.refused.empty());
}

TEST(Folder, ALaterEpochIsNewerWhateverItsFrame) {
  SimulatedDisk disk;
  Folder folder(disk);
  ASSERT_TRUE(store(folder, 5000));
  ASSERT_TRUE(store(folder, 10, kEpoch + 1));
  EXPECT_EQ(newest_frame(disk), 10U);
}

TEST(Folder, ACheckpointThatCouldNotBeReadIsNotStoredAndThatIsTold) {
  SimulatedDisk disk;
  Folder folder(disk);
  ASSERT_TRUE(store(folder, 30));
  Writer writer(
      &folder, 1, [] { return std::int64_t{0}; }, {}, WritesIn::kWriteNow);
  writer.keep_latest(true);
  writer.take(0, [](Checkpoint& copy) { copy = sample(kLastEpoch + 1, 60); });
  writer.write_now();
  EXPECT_EQ(newest_frame(disk), 30U);
  EXPECT_EQ(writer.latest(), nullptr);
  EXPECT_EQ(writer.figures(0).failed, 1U);
  const auto notices = writer.take_notices(0);
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_NE(notices[0].find("it is of frame 60 of epoch 9007199254740993"), std::string::npos) << notices[0];
}

// Whoever begins above such a name writes what no reader takes.
TEST(Folder, ANameBeyondAllClocksRaisesNoEpoch) {
  SimulatedDisk disk;
  Folder folder(disk);
  ASSERT_TRUE(store(folder, 30));
  for (const Epoch epoch :
       {Epoch{32'000'000'000'001}, kLastEpoch - 9, kLastEpoch - 1, kLastEpoch, kLastEpoch + 1, UINT64_MAX})
    ASSERT_TRUE(disk.write(file_name({epoch, 1}), std::vector<std::byte>(9)));
  const auto found = newest(disk);
  EXPECT_EQ(found.newest_epoch, kEpoch);
  EXPECT_EQ(found.checkpoint->frame, 30U);
}

TEST(Folder, ADamagedFileIsNamedWithTheReasonAndTheOneBeforeIsUsed) {
  SimulatedDisk disk;
  Folder folder(disk);
  for (const Frame frame : {30U, 60U, 90U}) ASSERT_TRUE(store(folder, frame));
  disk.content(file_name({kEpoch, 90})).resize(40);
  disk.content(file_name({kEpoch, 60}))[200] ^= std::byte{1};
  const auto found = newest(disk);
  ASSERT_TRUE(found.checkpoint);
  EXPECT_EQ(found.checkpoint->frame, 30U);
  ASSERT_EQ(found.refused.size(), 2U);
  EXPECT_NE(found.refused[0].find("disk/" + file_name({kEpoch, 90}) + ": it says that it has"),
            std::string::npos);
  EXPECT_NE(found.refused[1].find(": its checksum is wrong"), std::string::npos);
}

TEST(Folder, WhatTheServerRefusesIsLeftWhereItIs) {
  SimulatedDisk disk;
  {
    Folder other(disk);
    for (const Frame frame : {30U, 60U, 90U}) ASSERT_TRUE(store(other, frame));
  }
  Folder folder(disk);
  const auto found = folder.newest([](const Checkpoint& c) -> Result<void> {
    return c.frame > 30 ? fail(ErrorCode::kInvalidArgument, "of a later build") : Result<void>();
  });
  ASSERT_TRUE(found->checkpoint);
  EXPECT_EQ(found->checkpoint->frame, 30U);
  for (Frame frame = 10; frame <= 60; frame += 10) ASSERT_TRUE(store(folder, frame, kEpoch + 5));
  const auto names = *disk.list();
  EXPECT_EQ(names.size(), 5U) << "three of this run, two that another build may read";
  EXPECT_EQ(names[0], file_name({kEpoch, 60}));
}

// As a server that was started with another seed, twice.
TEST(Folder, WhatTheServerRefusesStaysWhenItIsOlderThanItsOwnToo) {
  SimulatedDisk disk;
  {
    Folder other(disk);
    for (const Frame frame : {30U, 60U, 90U}) ASSERT_TRUE(store(other, frame));
  }
  const auto accept = [](const Checkpoint& c) -> Result<void> {
    return c.epoch == kEpoch ? fail(ErrorCode::kInvalidArgument, "of another seed") : Result<void>();
  };
  for (const Epoch epoch : {kEpoch + 5, kEpoch + 6, kEpoch + 7}) {
    Folder folder(disk);
    const auto found = folder.newest(accept);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->refused.size(), epoch == kEpoch + 5 ? 3U : 0U) << "older ones are no news";
    for (Frame frame = 10; frame <= 60; frame += 10) ASSERT_TRUE(store(folder, frame, epoch));
  }
  EXPECT_EQ(newest(disk).checkpoint->epoch, kEpoch + 7);
  const auto names = names_of(disk);
  EXPECT_EQ(names.size(), 6U) << "three of another seed, and the last three";
  EXPECT_EQ(names[0], file_name({kEpoch, 30}));
  EXPECT_EQ(names[3], file_name({kEpoch + 7, 40}));
}

TEST(Folder, TheNewestIsTheLastThatIsAccepted) {
  SimulatedDisk disk;
  {
    Folder other(disk);
    for (const Epoch epoch : {kEpoch, kEpoch + 1}) ASSERT_TRUE(store(other, 30, epoch));
    ASSERT_TRUE(store(other, 60, kEpoch + 1));
  }
  disk.content(file_name({kEpoch + 1, 60}))[200] ^= std::byte{1};
  std::vector<Epoch> asked;
  Folder folder(disk);
  const auto found = folder.newest([&asked](const Checkpoint& c) {
    asked.push_back(c.epoch);
    return Result<void>();
  });
  ASSERT_TRUE(found && found->checkpoint);
  EXPECT_EQ(found->checkpoint->frame, 30U);
  EXPECT_EQ(asked, (std::vector<Epoch>{kEpoch, kEpoch + 1}));
  EXPECT_EQ(found->refused.size(), 1U);
}

TEST(Folder, AFileUnderAnotherNameIsRefused) {
  SimulatedDisk disk;
  Folder folder(disk);
  ASSERT_TRUE(store(folder, 30));
  ASSERT_TRUE(disk.rename(file_name({kEpoch, 30}), file_name({kEpoch, 31})));
  const auto found = newest(disk);
  EXPECT_FALSE(found.checkpoint);
  EXPECT_EQ(found.refused.size(), 1U);
}

TEST(Folder, OtherFilesAreNobodysAndStay) {
  SimulatedDisk disk;
  for (const char* name : {"notes.txt", "1-2.checkpoint", "copy.checkpoint.part", ".", ".."})
    ASSERT_TRUE(disk.write(name, {}));
  ASSERT_TRUE(disk.write(file_name({kEpoch, 7}) + ".part", {}));
  Folder folder(disk);
  ASSERT_TRUE(store(folder, 30));
  const auto found = newest(disk);
  EXPECT_TRUE(found.refused.empty());
  EXPECT_EQ(disk.list()->size(), 6U) << "but for the rest of a write that did not end";
}

TEST(Folder, AFailureNamesTheFileAndTheReason) {
  SimulatedDisk disk;
  Folder folder(disk);
  ASSERT_TRUE(store(folder, 30));
  disk.fails_with = "No space left on device";
  const auto stored = store(folder, 60);
  ASSERT_FALSE(stored);
  EXPECT_EQ(stored.error().message, "disk/" + file_name({kEpoch, 60}) + ": No space left on device");
  disk.fails_with.clear();
  EXPECT_EQ(newest_frame(disk), 30U);
}

// The power fails at every step of a run, and afterwards the disk holds any of the changes of names that were
// not synced, and any part of the bytes that were not.
void lose_power_everywhere(bool lies) {
  constexpr Frame kRuns = 6;
  constexpr std::size_t kParts = 16;
  std::uint64_t cases = 0;
  for (std::uint64_t at = 0;; ++at) {
    SimulatedDisk disk;
    disk.power_fails_at = at;
    Folder folder(disk);
    Frame stored = 0;
    for (Frame frame = 1; frame <= kRuns && store(folder, frame); ++frame) stored = frame;
    for (std::size_t changes = 0; changes <= disk.unsynced_changes(); ++changes) {
      for (std::size_t kept = 0; kept <= kParts; ++kept) {
        SimulatedDisk after = disk.after_power_loss(changes, kept, kParts);
        Frame complete = 0;
        for (const std::string& name : names_of(after))
          if (moment_of(name) && decode(after.content(name)))
            complete = std::max(complete, moment_of(name)->frame);
        ASSERT_EQ(newest_frame(after), complete)
            << "step " << at << ", change " << changes << ", part " << kept;
        if (!lies) {
          ASSERT_GE(complete, stored) << "what store() promised is there";
        }
        // The next run goes on from there.
        Folder next(after);
        ASSERT_TRUE(store(next, kRuns + 1));
        ASSERT_EQ(newest_frame(after), kRuns + 1);
        ++cases;
      }
    }
    if (stored == kRuns) break;
  }
  EXPECT_GT(cases, 500U);
}

TEST(PowerLoss, AtEveryStepTheNewestCompleteCheckpointIsFound) { lose_power_everywhere(false); }
TEST(PowerLoss, OnADiskThatLosesEverySyncTheNewestCompleteOneIsFoundToo) { lose_power_everywhere(true); }

TEST(PowerLoss, EveryByteOfAWriteMayBeTheLast) {
  SimulatedDisk disk;
  Folder folder(disk);
  ASSERT_TRUE(store(folder, 1));
  std::vector<std::byte> bytes;
  ASSERT_TRUE(encode(sample(kEpoch, 2), bytes));
  disk.lies = true;
  ASSERT_TRUE(store(folder, 2));
  for (std::size_t kept = 0; kept <= bytes.size(); ++kept) {
    SimulatedDisk after = disk.after_power_loss(disk.unsynced_changes(), kept, bytes.size());
    ASSERT_EQ(newest_frame(after), kept == bytes.size() ? 2U : 1U) << kept;
  }
}

}  // namespace
}  // namespace tandem::checkpoint
