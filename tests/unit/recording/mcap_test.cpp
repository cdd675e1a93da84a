#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "services/recording/mcap_format.hpp"
#include "services/recording/mcap_reader.hpp"
#include "services/recording/mcap_writer.hpp"
#include "tests/unit/transport/random_messages.hpp"

namespace tandem::recording {
namespace {

using transport::Bytes;
using transport::DeltaMessage;
using transport::RandomMessages;
using transport::SessionMessage;

class Mcap : public ::testing::TestWithParam<Compression> {
 protected:
  McapWriter writer() {
    return McapWriter(
        [this](std::span<const std::byte> bytes) -> Result<void> {
          if (file.size() + bytes.size() > room) return fail(ErrorCode::kIo, "full");
          file.insert(file.end(), bytes.begin(), bytes.end());
          return {};
        },
        GetParam());
  }
  // Topic, times and content of all messages; what went wrong last.
  struct Read {
    std::vector<std::string> messages;
    std::string error;
    bool torn = false;
  };
  [[nodiscard]] static Read read(const Bytes& bytes) {
    Read out;
    auto reader = McapReader::open(bytes);
    if (!reader) return {.messages = {}, .error = reader.error().message};
    out.torn = reader->torn_at().has_value();
    for (;;) {
      McapMessage message;
      const auto more = reader->next(message);
      if (!more) out.error = more.error().message;
      if (!more || !*more) return out;
      out.messages.push_back(
          std::string(message.topic) + " " + std::to_string(message.log_time_ns) + " " +
          std::to_string(message.publish_time_ns) + " " +
          std::string(reinterpret_cast<const char*>(message.content.data()), message.content.size()));
    }
  }
  // 40 seconds of deltas.
  void write_deltas(bool finish = true) {
    auto out = writer();
    RandomMessages random(1);
    for (std::int64_t i = 0; i < 40; ++i) {
      const std::int64_t ns = i * 1'000'000'000;
      if (i % 10 == 0) out.end_chunk();
      if (i % 10 == 0) out.add(random.make<SessionMessage>(), ns, ns);
      out.add(random.make<DeltaMessage>(), ns, ns - 1);
    }
    if (finish) {
      ASSERT_TRUE(out.finish());
    } else {
      out.end_chunk();
    }
  }
  // Where chunk `n` stands in the file.
  [[nodiscard]] std::size_t chunk(std::size_t n) const {
    for (std::size_t at = 8; at < file.size();) {
      if (file[at] == std::byte{kChunk} && n-- == 0) return at;
      std::uint64_t size = 0;
      for (std::size_t i = 8; i > 0; --i) size = size << 8U | std::to_integer<std::uint64_t>(file[at + i]);
      at += kRecordHead + size;
    }
    return file.size();
  }
  Bytes file;
  std::size_t room = SIZE_MAX;
};
INSTANTIATE_TEST_SUITE_P(Compressions, Mcap, ::testing::Values(Compression::kNone, Compression::kZstd));

TEST_P(Mcap, WhatIsWrittenIsReadInItsOrder) {
  RandomMessages random(1);
  const auto session = random.make<SessionMessage>();
  const auto delta = random.make<DeltaMessage>();
  auto out = writer();
  out.add(session, 100, 100);
  out.add(delta, 300, 250);
  out.add(delta, 200, -5);
  ASSERT_TRUE(out.finish());
  const Read found = read(file);
  EXPECT_EQ(found.error, "");
  EXPECT_FALSE(found.torn);
  Bytes cdr;
  transport::write_cdr(delta, cdr);
  const std::string content(reinterpret_cast<const char*>(cdr.data()), cdr.size());
  ASSERT_EQ(found.messages.size(), 3U);
  EXPECT_EQ(found.messages[0].substr(0, 22), "TandemSession 100 100 ");
  EXPECT_EQ(found.messages[1], "TandemDelta 300 250 " + content);
  EXPECT_EQ(found.messages[2], "TandemDelta 200 0 " + content) << "a time before 1970";
}

TEST_P(Mcap, ChunksThatHoldATopicAreFoundByTheirIndexes) {
  for (const bool finish : {true, false}) {
    file.clear();
    write_deltas(finish);
    auto reader = McapReader::open(file);
    ASSERT_TRUE(reader);
    EXPECT_EQ(reader->last_ns(), 39'000'000'000U);
    const auto starts = reader->chunks_with("TandemSession");
    ASSERT_EQ(starts.size(), 4U);
    EXPECT_EQ(starts[2].first_ns, 20'000'000'000U);
    reader->go_to(starts[2]);
    McapMessage message;
    ASSERT_TRUE(*reader->next(message));
    EXPECT_EQ(message.topic, "TandemSession");
    EXPECT_EQ(message.log_time_ns, 20'000'000'000U);
    EXPECT_TRUE(reader->chunks_with("TandemReply").empty());
  }
}

TEST_P(Mcap, AFileCutShortIsReadUpToTheTear) {
  write_deltas();
  const Read whole = read(file);
  ASSERT_EQ(whole.messages.size(), 44U);
  std::size_t most = 0;
  for (std::size_t size = 8; size < file.size(); size += 1 + file.size() / 500) {
    const Read found = read(Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size)));
    ASSERT_EQ(found.error, "") << size;
    EXPECT_TRUE(found.torn);
    ASSERT_LE(found.messages.size(), whole.messages.size());
    EXPECT_TRUE(std::equal(found.messages.begin(), found.messages.end(), whole.messages.begin()));
    EXPECT_GE(found.messages.size(), most);
    most = found.messages.size();
  }
  EXPECT_EQ(most, whole.messages.size());
}

TEST_P(Mcap, ADamagedChunkIsAnErrorThatSaysWhere) {
  write_deltas();
  const std::size_t at = chunk(2);
  file[at + 70] ^= std::byte{1};
  const Read found = read(file);
  EXPECT_EQ(found.error.substr(0, found.error.find(':')), "at byte " + std::to_string(at));
  EXPECT_NE(found.error.find("damaged chunk"), std::string::npos) << found.error;
  EXPECT_LT(found.messages.size(), 44U);
}

TEST_P(Mcap, AChunkOfAHugeSizeIsRefused) {
  write_deltas();
  for (std::size_t i = 0; i < 5; ++i) file[chunk(0) + kRecordHead + 16 + i] = std::byte{0xFF};
  const Read found = read(file);
  EXPECT_NE(found.error.find("at most 402653184"), std::string::npos) << found.error;
}

TEST_P(Mcap, WhatNoReaderTakesIsNotWritten) {
  auto out = writer();
  out.declare<SessionMessage>();
  // Not touched, so it costs no memory.
  const std::unique_ptr<std::byte[]> bytes(new std::byte[kMaxChunkBytes]);
  out.add(SessionMessage::kTopic, {bytes.get(), kMaxChunkBytes}, 0, 0);
  ASSERT_FALSE(out.written());
  EXPECT_EQ(out.written().error().code, ErrorCode::kCapacity);
}

TEST_P(Mcap, ARecordOfAHugeLengthEndsTheFile) {
  write_deltas();
  const std::size_t at = chunk(3);
  for (std::size_t i = 1; i <= 8; ++i) file[at + i] = std::byte{0xFF};
  const Read found = read(file);
  EXPECT_EQ(found.error, "");
  EXPECT_TRUE(found.torn);
  EXPECT_FALSE(found.messages.empty());
}

TEST_P(Mcap, WhatIsNotMcapIsRefused) {
  EXPECT_EQ(read({}).error, "not an MCAP file: its first eight bytes are others");
  EXPECT_EQ(read(Bytes(100)).error, "not an MCAP file: its first eight bytes are others");
  write_deltas();
  file[5] = std::byte{'1'};
  EXPECT_EQ(read(file).error, "MCAP of another version than 0, which is the one that is read");
}

TEST_P(Mcap, AFileWithoutMessagesIsAFile) {
  ASSERT_TRUE(writer().finish());
  const Read found = read(file);
  EXPECT_EQ(found.error, "");
  EXPECT_FALSE(found.torn);
  EXPECT_TRUE(found.messages.empty());
}

TEST_P(Mcap, ASinkThatFailsIsNotCalledAgainAndItsErrorIsTold) {
  room = 500;
  auto out = writer();
  out.add(RandomMessages(1).make<DeltaMessage>(), 0, 0);
  out.end_chunk();
  const std::size_t then = file.size();
  room = SIZE_MAX;
  out.add(RandomMessages(2).make<DeltaMessage>(), 0, 0);
  const auto finished = out.finish();
  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().message, "full");
  EXPECT_EQ(file.size(), then);
}

TEST(Recording, CarriesTheTypesAsTheyStandInTheRepository) {
  std::ifstream in(TANDEM_TEST_IDL);
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_EQ(idl_text(), text.str());
}

TEST(Recording, ChecksumsAreThoseOfZlib) {
  const std::string text = "123456789";
  const auto bytes = std::as_bytes(std::span(text));
  EXPECT_EQ(crc32(bytes), 0xCBF43926U);
  EXPECT_EQ(crc32(bytes.subspan(4), crc32(bytes.first(4))), 0xCBF43926U);
}

}  // namespace
}  // namespace tandem::recording
