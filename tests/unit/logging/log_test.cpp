#include "services/program/logging/log.hpp"

#include <gmock/gmock.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "services/program/logging/lines.hpp"

namespace tandem::logging {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

std::int64_t now_ns = 0;

/// A log into a string.
class Log {
 public:
  explicit Log(Look look) : context_(std::make_shared<Context>()) {
    now_ns = 1'000'000'000;
    auto sink = std::make_shared<spdlog::sinks::ostream_sink_st>(out_);
    sink->set_formatter(std::make_unique<LineFormatter>(look, context_));
    logger = std::make_shared<spdlog::logger>("tandemd",
                                              std::make_shared<LimitedSink>(sink, [] { return now_ns; }));
    logger->set_level(spdlog::level::trace);
  }
  Context& context() { return *context_; }
  std::vector<std::string> lines() {
    std::vector<std::string> all;
    std::string line;
    std::istringstream in(out_.str());
    while (std::getline(in, line)) all.push_back(line);
    return all;
  }
  std::shared_ptr<spdlog::logger> logger;

 private:
  std::shared_ptr<Context> context_;
  std::ostringstream out_;
};

TEST(Log, ALineOfTextHasTimeProgramLevelSessionAndEpoch) {
  Log log(Look::kText);
  log.logger->info("before it is known");
  log.context().set("arena", 1234);
  log.logger->warn("a client is gone");
  ASSERT_EQ(log.lines().size(), 2U);
  EXPECT_THAT(log.lines()[0], EndsWith("] [tandemd] [info] before it is known"));
  EXPECT_THAT(
      log.lines()[1],
      MatchesRegex(
          "\\[....-..-.. ..:..:..\\....\\] \\[tandemd\\] \\[arena 1234\\] \\[warning\\] a client is gone"));
}

TEST(Log, AMessageOfSeveralLinesStaysOneLine) {
  for (const Look look : {Look::kText, Look::kJournal, Look::kJson}) {
    Log log(look);
    log.logger->info("one\ntwo\x1b[31m\r\x7f");
    ASSERT_EQ(log.lines().size(), 1U);
    EXPECT_THAT(log.lines()[0], HasSubstr("one two [31m"));
  }
}

TEST(Log, JsonIsOneObjectALineWithStableKeys) {
  Log log(Look::kJson);
  log.context().set("arena", 1795470882419);
  log.logger->error("\"quoted\" \\ and \xC3\xA4");
  const auto line = nlohmann::json::parse(log.lines().at(0));
  EXPECT_EQ(line["level"], "error");
  EXPECT_EQ(line["program"], "tandemd");
  EXPECT_EQ(line["session"], "arena");
  EXPECT_EQ(line["epoch"], 1795470882419);
  EXPECT_EQ(line["message"], "\"quoted\" \\ and \xC3\xA4");
  EXPECT_THAT(std::string(line["time"]), MatchesRegex("....-..-..T..:..:..\\....Z"));
  EXPECT_EQ(line.size(), 6U);
}

TEST(Log, JournaldGetsItsPrioritiesAndNoTime) {
  Log log(Look::kJournal);
  log.context().set("arena", 7);
  log.logger->error("e");
  log.logger->warn("w");
  log.logger->info("i");
  log.logger->debug("d");
  EXPECT_EQ(log.lines(), (std::vector<std::string>{"<3>[arena 7] e", "<4>[arena 7] w", "<6>[arena 7] i",
                                                   "<7>[arena 7] d"}));
}

TEST(Log, AFloodIsCutToTheRateAndSaysHowManyLinesWereLeftOut) {
  Log log(Look::kText);
  for (int i = 0; i < 5000; ++i) log.logger->info("line");
  EXPECT_LE(log.lines().size(), static_cast<std::size_t>(kBurst) + 2);
  log.logger->error("an error comes through");
  EXPECT_THAT(log.lines().back(), EndsWith("an error comes through"));
  now_ns += 11'000'000'000;
  log.logger->info("later");
  EXPECT_THAT(log.lines().back(), HasSubstr("lines were left out"));
  std::size_t lines = log.lines().size();
  now_ns += 60'000'000'000;
  log.logger->info("much later");
  EXPECT_EQ(log.lines().size(), lines + 1) << "it is told once";
}

}  // namespace
}  // namespace tandem::logging
