#include "sdk/transport/mcap.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "random_messages.hpp"

namespace tandem::transport {
namespace {

struct Record {
  unsigned opcode = 0;
  std::size_t at = 0;  // of the record in the file
  std::string content;
};

std::uint64_t number(const std::string& bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) {
    value |= std::uint64_t{static_cast<unsigned char>(bytes.at(at + i))} << (8 * i);
  }
  return value;
}

class Mcap : public ::testing::Test {
 protected:
  McapWriter writer() {
    return McapWriter([this](std::span<const std::byte> bytes) -> Result<void> {
      if (file.size() + bytes.size() > room) return fail(ErrorCode::kIo, "full");
      file.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      return {};
    });
  }
  [[nodiscard]] std::vector<Record> records() const {
    const std::string magic("\x89MCAP0\r\n", 8);
    EXPECT_EQ(file.substr(0, 8), magic);
    EXPECT_EQ(file.substr(file.size() - 8), magic);
    std::vector<Record> out;
    for (std::size_t at = 8; at < file.size() - 8;) {
      const std::size_t size = number(file, at + 1, 8);
      out.push_back({static_cast<unsigned char>(file.at(at)), at, file.substr(at + 9, size)});
      at += 9 + size;
    }
    return out;
  }
  std::string file;
  std::size_t room = SIZE_MAX;
};

TEST_F(Mcap, AFileIsHeaderSchemasChannelsMessagesSummaryFooter) {
  RandomMessages random(1);
  const auto session = random.make<SessionMessage>();
  const auto delta = random.make<DeltaMessage>();
  auto out = writer();
  out.add(session, 100, 100);
  out.add(delta, 300, 250);
  out.add(delta, 200, -5);
  ASSERT_TRUE(out.finish());
  const auto all = records();
  std::vector<unsigned> opcodes;
  for (const Record& record : all) opcodes.push_back(record.opcode);
  EXPECT_EQ(opcodes, (std::vector<unsigned>{1, 3, 4, 5, 3, 4, 5, 5, 15, 3, 3, 4, 4, 11, 2}));
  EXPECT_EQ(all[0].content.substr(0, 4), std::string(4, '\0')) << "no profile";
  EXPECT_NE(all[0].content.find("tandem "), std::string::npos);
  EXPECT_NE(all[1].content.find("tandem::TandemSession"), std::string::npos);
  EXPECT_NE(all[1].content.find("omgidl"), std::string::npos);
  EXPECT_NE(all[1].content.find("@final struct TandemSession {"), std::string::npos);
  EXPECT_EQ(number(all[2].content, 0, 2), number(all[1].content, 0, 2));

  Bytes cdr;
  write_cdr(delta, cdr);
  const std::string& message = all[6].content;
  EXPECT_EQ(number(message, 0, 2), number(all[5].content, 0, 2)) << "channel";
  EXPECT_EQ(number(message, 2, 4), 0U) << "sequence";
  EXPECT_EQ(number(message, 6, 8), 300U) << "log time";
  EXPECT_EQ(number(message, 14, 8), 250U) << "publish time";
  EXPECT_EQ(message.substr(22), std::string(reinterpret_cast<const char*>(cdr.data()), cdr.size()));
  EXPECT_EQ(number(all[7].content, 2, 4), 1U);
  EXPECT_EQ(number(all[7].content, 14, 8), 0U) << "a time before 1970";

  EXPECT_EQ(number(all[13].content, 0, 8), 3U) << "messages";
  EXPECT_EQ(number(all[13].content, 26, 8), 100U) << "first";
  EXPECT_EQ(number(all[13].content, 34, 8), 300U) << "last";
  EXPECT_EQ(number(all[14].content, 0, 8), all[9].at) << "where the summary begins";
}

TEST_F(Mcap, CarriesTheTypesAsTheyStandInTheRepository) {
  std::ifstream in(TANDEM_TEST_IDL);
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_EQ(idl_text(), text.str());
}

TEST_F(Mcap, AFileWithoutMessagesIsAFile) {
  ASSERT_TRUE(writer().finish());
  EXPECT_EQ(records().size(), 4U);
}

TEST_F(Mcap, ASinkThatFailsIsNotCalledAgainAndItsErrorIsTold) {
  room = 500;
  auto out = writer();
  out.add(RandomMessages(1).make<DeltaMessage>(), 0, 0);
  const std::size_t then = file.size();
  room = SIZE_MAX;
  out.add(RandomMessages(2).make<DeltaMessage>(), 0, 0);
  const auto finished = out.finish();
  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().message, "full");
  EXPECT_EQ(file.size(), then);
}

}  // namespace
}  // namespace tandem::transport
