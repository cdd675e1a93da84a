#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <numeric>
#include <sstream>

#include "services/follow/recording/mcap_format.hpp"
#include "services/follow/recording/mcap_reader.hpp"
#include "services/follow/recording/mcap_writer.hpp"
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
    McapReader::Damage damage = {};
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
      out.damage = reader->damage();
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
    EXPECT_TRUE(reader->in_order());
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

TEST_P(Mcap, ADamagedChunkIsPassedOverAndToldWithItsPlace) {
  write_deltas();
  const Read whole = read(file);
  const std::size_t at = chunk(2);
  file[at + 70] ^= std::byte{1};
  const Read found = read(file);
  EXPECT_EQ(found.error, "");
  EXPECT_EQ(found.damage.chunks, 1U);
  EXPECT_EQ(found.damage.first.find("at byte " + std::to_string(at) + ": a damaged chunk"), 0U)
      << found.damage.first;
  EXPECT_GT(found.messages.size(), 30U);
  EXPECT_LT(found.messages.size(), 44U);
  EXPECT_EQ(found.messages.back(), whole.messages.back());
  file[chunk(4) + 70] ^= std::byte{1};
  EXPECT_EQ(read(file).damage.chunks, 2U);
}

// What a tool makes of a recording: the messages of `file` in another order, or without chunks.
class Rewritten : public ::testing::Test {
 protected:
  struct Message {
    std::string topic;
    std::int64_t ns = 0;
    Bytes content;
  };
  // A file of another program's: only the name of the library in its header tells.
  static Bytes write(const std::vector<Message>& messages, std::size_t chunk_messages,
                     Compression compression = Compression::kZstd) {
    Bytes out;
    McapWriter writer(
        [&out](std::span<const std::byte> bytes) -> Result<void> {
          out.insert(out.end(), bytes.begin(), bytes.end());
          return {};
        },
        compression);
    std::size_t count = 0;
    for (const Message& message : messages) {
      writer.declare({.topic = message.topic,
                      .message_encoding = "cdr",
                      .schema_name = {},
                      .schema_encoding = {},
                      .schema = {}});
      writer.add(message.topic, message.content, message.ns, message.ns);
      if (++count % chunk_messages == 0) writer.end_chunk();
    }
    EXPECT_TRUE(writer.finish());
    const std::string ours = "tandem ";
    const auto library = std::search(out.begin(), out.end(), ours.begin(), ours.end(),
                                     [](std::byte a, char b) { return a == static_cast<std::byte>(b); });
    *library = std::byte{'T'};
    return out;
  }
  // The same without chunks, indexes and summary.
  static Bytes unchunked(const Bytes& file) {
    constexpr std::size_t kChunkHead = 8 + 8 + 8 + 4 + 4 + 8;
    Bytes out(file.begin(), file.begin() + 8);
    for (std::size_t at = 8; at + kRecordHead <= file.size() && file[at] != std::byte{kDataEnd};) {
      std::uint64_t size = 0;
      for (std::size_t i = 8; i > 0; --i) size = size << 8U | std::to_integer<std::uint64_t>(file[at + i]);
      const auto begin = file.begin() + static_cast<std::ptrdiff_t>(at);
      const auto end = begin + static_cast<std::ptrdiff_t>(kRecordHead + size);
      if (file[at] == std::byte{kHeader}) out.insert(out.end(), begin, end);
      if (file[at] == std::byte{kChunk}) out.insert(out.end(), begin + kRecordHead + kChunkHead, end);
      at += kRecordHead + size;
    }
    return out;
  }
  static std::vector<Message> messages(int count) {
    std::vector<Message> all;
    for (int i = 0; i < count; ++i)
      all.push_back({i % 3 == 0 ? "a" : "b", 1000 + i, Bytes(10, static_cast<std::byte>(i))});
    return all;
  }
  static std::vector<std::int64_t> times(McapReader& reader) {
    std::vector<std::int64_t> found;
    McapMessage message;
    for (auto more = reader.next(message); more && *more; more = reader.next(message))
      found.push_back(static_cast<std::int64_t>(message.log_time_ns));
    return found;
  }
  static std::vector<std::int64_t> in_order(int count) {
    std::vector<std::int64_t> expected(static_cast<std::size_t>(count));
    std::iota(expected.begin(), expected.end(), 1000);
    return expected;
  }
};

TEST_F(Rewritten, AFileThatAnotherProgramWroteIsReadByLogTime) {
  const auto all = messages(120);
  auto by_topic = all;
  std::ranges::stable_sort(by_topic, {}, &Message::topic);
  auto backwards = all;
  std::ranges::reverse(backwards);
  for (const auto& order : {all, by_topic, backwards}) {
    for (const std::size_t chunk_messages : {1U, 7U, 1000U}) {
      const Bytes file = write(order, chunk_messages);
      auto reader = McapReader::open(file);
      ASSERT_TRUE(reader) << reader.error().message;
      EXPECT_EQ(times(*reader), in_order(120)) << chunk_messages;
      reader->rewind();
      EXPECT_EQ(times(*reader), in_order(120)) << "once more";
      EXPECT_EQ(reader->first_ns(), 1000U);
      EXPECT_EQ(reader->last_ns(), 1119U);
    }
  }
}

TEST_F(Rewritten, MessagesInNoChunkAreReadByLogTimeToo) {
  auto by_topic = messages(120);
  std::ranges::stable_sort(by_topic, {}, &Message::topic);
  const Bytes file = unchunked(write(by_topic, 1000, Compression::kNone));
  auto reader = McapReader::open(file);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_EQ(times(*reader), in_order(120));
  EXPECT_EQ(reader->first_ns(), 1000U);
  EXPECT_EQ(reader->last_ns(), 1119U);
  EXPECT_EQ(reader->chunks_with("a").size(), 1U);
}

TEST_F(Rewritten, MessagesOfTheSameTimeComeByTheirRankAndThenAsTheyStand) {
  auto all = messages(6);
  for (Message& message : all) message.ns = 5;
  const Bytes file = write(all, 2);
  auto reader = McapReader::open(file, [](std::string_view topic) { return topic == "b" ? 0U : 1U; });
  ASSERT_TRUE(reader);
  std::string found;
  McapMessage message;
  while (*reader->next(message))
    found += std::string(message.topic) + std::to_string(int(message.content[0])) + ' ';
  EXPECT_EQ(found, "b1 b2 b4 b5 a0 a3 ");
}

TEST_F(Rewritten, ChunksThatAllOverlapAreRefusedWithWhatHelps) {
  auto all = messages(2 * static_cast<int>(McapReader::kMaxOpen) + 2);
  for (std::size_t i = 1; i < all.size(); i += 2) all[i].ns = 1'000'000;
  const Bytes file = write(all, 2);
  auto reader = McapReader::open(file);
  ASSERT_TRUE(reader);
  McapMessage message;
  auto more = reader->next(message);
  while (more && *more) more = reader->next(message);
  ASSERT_FALSE(more);
  EXPECT_EQ(more.error().code, ErrorCode::kUnsupported);
  EXPECT_NE(more.error().message.find("mcap sort"), std::string::npos);
}

TEST_P(Mcap, AChunkOfAHugeSizeIsRefused) {
  write_deltas();
  for (std::size_t i = 0; i < 5; ++i) file[chunk(0) + kRecordHead + 16 + i] = std::byte{0xFF};
  const Read found = read(file);
  EXPECT_NE(found.error.find("at most " + std::to_string(kMaxChunkBytes)), std::string::npos) << found.error;
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
  EXPECT_EQ(crc32({}, 0xCBF43926U), 0xCBF43926U);
}

}  // namespace
}  // namespace tandem::recording
