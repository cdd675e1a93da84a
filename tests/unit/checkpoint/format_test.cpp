#include "services/host/checkpoint/format.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/wire/limits.hpp"
#include "tests/unit/checkpoint/sample.hpp"

namespace tandem::checkpoint {
namespace {

using Bytes = std::vector<std::byte>;

Bytes encoded(const Checkpoint& checkpoint) {
  Bytes bytes;
  const auto made = encode(checkpoint, bytes);
  const auto read = decode(bytes);
  EXPECT_EQ(made.has_value(), read.has_value()) << "the writer refuses what its reader would";
  return bytes;
}

// Whoever changes a byte on purpose computes the checksum anew.
void seal(Bytes& file) {
  const std::uint64_t sum = hash_bytes(std::span(file).first(file.size() - 8));
  std::memcpy(file.data() + file.size() - 8, &sum, sizeof sum);
}

std::string reason(const Bytes& file) {
  const auto read = decode(file);
  return read ? "" : read.error().message;
}

void expect_sample(const Checkpoint& c) {
  const Checkpoint wanted = sample();
  EXPECT_EQ(c.session, wanted.session);
  EXPECT_EQ(c.types, wanted.types);
  EXPECT_EQ(c.gravity, wanted.gravity);
  EXPECT_EQ(c.next_reuse, wanted.next_reuse);
  EXPECT_EQ(c.withheld, wanted.withheld);
  ASSERT_EQ(c.streams.size(), 2U);
  EXPECT_EQ(c.streams[0].layout_hash, wanted.streams[0].layout_hash);
  EXPECT_EQ(c.streams[1].parameters, wanted.streams[1].parameters);
  ASSERT_EQ(c.scheduled.size(), 2U);
  EXPECT_EQ(c.scheduled[1].frame, wanted.scheduled[1].frame);
  EXPECT_EQ(c.scheduled[1].input.values, wanted.scheduled[1].input.values);
  ASSERT_EQ(c.immediate.size(), 2U);
  EXPECT_EQ(c.immediate[1].bytes, wanted.immediate[1].bytes);
  ASSERT_EQ(c.clients.size(), 1U);
  EXPECT_EQ(c.clients[0].from, wanted.clients[0].from);
  EXPECT_EQ(c.clients[0].outcomes, wanted.clients[0].outcomes);
  EXPECT_EQ(c.engine_state, wanted.engine_state);
}

TEST(Format, WhatIsWrittenIsRead) {
  const auto read = decode(encoded(sample()));
  ASSERT_TRUE(read) << read.error().message;
  expect_sample(*read);
  EXPECT_EQ(encoded(*read), encoded(sample()));
}

// A file of version 1, as it was written when there was no later version. It stays readable.
TEST(Format, AFileOfVersion1IsRead) {
  std::ifstream in(TANDEM_TEST_VERSION_1, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  ASSERT_FALSE(text.empty()) << TANDEM_TEST_VERSION_1;
  const auto bytes = std::as_bytes(std::span(text));
  const auto read = decode(bytes);
  ASSERT_TRUE(read) << read.error().message;
  expect_sample(*read);
}

TEST(Format, EveryPrefixIsRefusedWithAReason) {
  const Bytes whole = encoded(sample());
  for (std::size_t size = 0; size < whole.size(); ++size)
    ASSERT_NE(reason({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}), "") << size;
  EXPECT_EQ(reason({}), "it is empty");
  EXPECT_EQ(reason({whole.begin(), whole.begin() + 100}),
            "it says that it has " + std::to_string(whole.size()) + " bytes, but it has 100");
}

TEST(Format, EveryChangedByteIsRefused) {
  const Bytes whole = encoded(sample());
  for (std::size_t i = 0; i < whole.size(); ++i) {
    Bytes damaged = whole;
    damaged[i] ^= std::byte{0x10};
    ASSERT_NE(reason(damaged), "") << "byte " << i;
  }
}

// Whatever the bytes are: a reason or a checkpoint that keeps the rules, and no crash.
TEST(Format, EveryChangedByteUnderARightChecksumIsReadOrRefused) {
  const Bytes whole = encoded(sample());
  for (std::size_t i = 24; i + 8 < whole.size(); ++i) {
    for (const int value : {0x00, 0x7F, 0xFF}) {
      Bytes damaged = whole;
      damaged[i] = static_cast<std::byte>(value);
      seal(damaged);
      const auto read = decode(damaged);
      if (read) {
        EXPECT_EQ(read->next_reuse.size(), read->withheld.size());
      }
    }
  }
}

TEST(Format, AFileThatAnnouncesTenGigabytesIsRefusedByItsRealSize) {
  Bytes file = encoded(sample());
  const std::uint64_t announced = 10'000'000'000;
  std::memcpy(file.data() + 16, &announced, sizeof announced);
  seal(file);
  EXPECT_EQ(reason(file), "it says that it has 10000000000 bytes, but it has " + std::to_string(file.size()));
}

TEST(Format, AFrameOrEpochThatClientsCannotCountIsRefused) {
  EXPECT_EQ(reason(encoded(sample(1U, kLastFrame))), "");
  EXPECT_EQ(reason(encoded(sample(1000, kLastFrame + 1))), "it is of frame 9007199254740993 of epoch 1000");
  EXPECT_EQ(reason(encoded(sample(kLastEpoch + 1, 7))), "it is of frame 7 of epoch 9007199254740993");
  EXPECT_EQ(reason(encoded(sample(0, 7))), "it is of frame 7 of epoch 0");
}

TEST(Format, WhatIsTooLongToBeReadIsNotWritten) {
  const auto refused = [](const std::function<void(Checkpoint&)>& change) {
    Checkpoint c = sample();
    change(c);
    Bytes bytes;
    return !encode(c, bytes);
  };
  EXPECT_FALSE(refused([](Checkpoint& c) { c.scene.assign(4096, 'x'); }));
  EXPECT_TRUE(refused([](Checkpoint& c) { c.scene.assign(4097, 'x'); }));
  EXPECT_TRUE(refused([](Checkpoint& c) { c.types.back().assign(4097, 'x'); }));
  EXPECT_TRUE(refused([](Checkpoint& c) { c.types.assign(transport::kMaxTypes + 1, "x"); }));
  EXPECT_TRUE(refused([](Checkpoint& c) { c.streams.resize(transport::kMaxStreams + 1, c.streams[0]); }));
  EXPECT_TRUE(refused([](Checkpoint& c) { c.clients[0].outcomes.resize(transport::kReplyRing + 1); }));
  EXPECT_TRUE(refused([](Checkpoint& c) { c.immediate.resize(65537); }));
}

TEST(Format, AnotherVersionByteOrderOrKindOfFileIsNamed) {
  Bytes file = encoded(sample());
  file[10] = std::byte{9};
  seal(file);
  EXPECT_EQ(reason(file), "it has format version 9, and this build reads version 1");
  file = encoded(sample());
  std::swap(file[8], file[9]);
  seal(file);
  EXPECT_EQ(reason(file), "it was written by a machine of another byte order");
  file[0] = std::byte{'X'};
  EXPECT_EQ(reason(file), "it is no checkpoint");
}

TEST(Format, ASectionThatMattersAndIsUnknownIsRefusedAndAnotherSkipped) {
  const Bytes whole = encoded(sample());
  for (const bool critical : {true, false}) {
    Bytes file(whole.begin(), whole.end() - 8);
    for (const int byte : {99, 0, 0, critical ? 0x80 : 0, 1, 0, 0, 0, 0, 0, 0, 0, 5})
      file.push_back(static_cast<std::byte>(byte));
    file.resize(file.size() + 8);
    const std::uint64_t size = file.size();
    std::memcpy(file.data() + 16, &size, sizeof size);
    seal(file);
    EXPECT_EQ(reason(file), critical ? "it has a section 99 that this build does not know" : "");
  }
}

TEST(Format, InputsThatAreOutOfOrderAreRefused) {
  Checkpoint c = sample();
  std::swap(c.scheduled[0], c.scheduled[1]);
  EXPECT_EQ(reason(encoded(c)), "its scheduled inputs are not in order");
  c = sample();
  c.scheduled[0].frame = c.frame;
  EXPECT_EQ(reason(encoded(c)), "its scheduled inputs are not in order");
}

}  // namespace
}  // namespace tandem::checkpoint
