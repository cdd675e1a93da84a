#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "gateway.pb.h"
#include "relay.pb.h"
#include "services/gateway/gateway.hpp"
#include "services/program/configuration/command_line.hpp"
#include "services/program/configuration/common.hpp"
#include "services/program/configuration/file.hpp"

namespace tandem::configuration {
namespace {

using Config = idl::GatewayConfig;
using testing::HasSubstr;

const Form& form() {
  static const Form all(*Config::descriptor());
  return all;
}

class Configuration : public ::testing::Test {
 protected:
  ~Configuration() override { std::remove(path.c_str()); }
  /// Reads the command line with a file of this text.
  Outcome read(const std::string& text, std::vector<const char*> words, const Rules& rules = {}) {
    std::ofstream(path) << text;
    words.insert(words.begin(), {"program", "--config", path.c_str()});
    commandline::Program app("A program.", "program");
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    config.Clear();
    Outcome outcome = read_command_line(app, "program", form(), config, rules, static_cast<int>(words.size()),
                                        words.data());
    out = testing::internal::GetCapturedStdout();
    err = testing::internal::GetCapturedStderr();
    return outcome;
  }
  std::string path =
      (std::filesystem::temp_directory_path() /
       ("tandem-configuration-" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + "-" +
        ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".textproto"))
          .string();
  Config config;
  std::string out, err;
};

TEST_F(Configuration, FlagsWinOverTheFileAndTheirListsReplaceItsLists) {
  const Outcome outcome = read("port: 9000\nsession: \"arena\"\norigin: \"http://a\"\norigin: \"http://b\"\n",
                               {"--port", "9001", "--origin", "http://c", "--origin", "http://d"});
  EXPECT_FALSE(outcome.exit_code) << err;
  EXPECT_EQ(config.port(), 9001U);
  EXPECT_EQ(config.session(), "arena");
  EXPECT_THAT(config.origin(), testing::ElementsAre("http://c", "http://d"));
  EXPECT_EQ(outcome.places.of_field.count("port"), 0U);
  EXPECT_EQ(outcome.places.of_field.at("session"), path + ":2");
  EXPECT_FALSE(config.has_max_viewers()) << "a default is no setting";
  complete(form(), config);
  EXPECT_EQ(config.max_viewers(), 256U);
  EXPECT_EQ(config.port(), 9001U);
}

TEST_F(Configuration, ErrorsNameTheOptionAndItsRangeInALine) {
  EXPECT_EQ(read("", {"--port", "70000"}).exit_code, 2);
  EXPECT_THAT(err, HasSubstr("program: --port: must be 0 to 65535; 0 for any free one\n"));
  EXPECT_EQ(read("\nmax_viewers: 0\n", {}).exit_code, 2);
  EXPECT_EQ(err, "program: " + path + ":2: field \"max_viewers\": must be 1 to 16384\n");
  EXPECT_EQ(read("max_viewers: \"many\"\n", {}).exit_code, 2);
  EXPECT_THAT(err, HasSubstr(path + ":1: field \"max_viewers\""));
  EXPECT_THAT(err, HasSubstr("it takes 1 to 16384"));
  EXPECT_EQ(read("max_guests: 1\n", {}).exit_code, 2);
  EXPECT_THAT(err, HasSubstr("field \"max_guests\" is unknown; program --print-config shows all"));
  EXPECT_EQ(read("", {"--max-viewers", "-1"}).exit_code, 2);
  EXPECT_THAT(err, HasSubstr("--max-viewers: must be a whole number"));
  EXPECT_EQ(read("", {"--address-joins", "nan"}).exit_code, 2);
  EXPECT_THAT(err, HasSubstr("--address-joins: must be 1 to 1e6"));
  EXPECT_EQ(read("", {"--log-level", "loud"}).exit_code, 2);
  EXPECT_THAT(err, HasSubstr("--log-level: must be error, warning, info or debug"));
}

// --secure "$DIR", where nobody set DIR.
TEST_F(Configuration, AnEmptyTextIsNotTakenForNoneButWhereItMeansSomething) {
  EXPECT_EQ(read("", {"--secure", ""}).exit_code, 2);
  EXPECT_THAT(err, HasSubstr("--secure: is empty"));
  EXPECT_EQ(read("token_key: \"\"\n", {}).exit_code, 2);
  EXPECT_THAT(err, HasSubstr("field \"token_key\": is empty"));
  EXPECT_FALSE(read("", {"--viewer", ""}).exit_code);
  EXPECT_TRUE(config.has_viewer());
}

TEST_F(Configuration, TheProgramsOwnCheckNamesFileAndLine) {
  Rules rules;
  rules.check = [](const google::protobuf::Message&) -> Result<void> {
    return fail(ErrorCode::kInvalidArgument, "--site: is far away");
  };
  EXPECT_EQ(read("\n\nsite: \"moon\"\n", {}, rules).exit_code, 2);
  EXPECT_EQ(err, "program: " + path + ":3: field \"site\": is far away\n");
  EXPECT_EQ(read("", {"--check-config"}, rules).exit_code, 2);
  EXPECT_EQ(read("", {"--check-config"}).exit_code, 0);
  EXPECT_EQ(out, "the configuration is good\n");
}

TEST_F(Configuration, WhatIsPrintedIsReadAgain) {
  EXPECT_EQ(read("session: \"arena\" token_key: \"a\" token_key: \"b\"", {"--print-config"}).exit_code, 0);
  const std::string printed = out;
  EXPECT_THAT(printed, HasSubstr("# Maximum number of viewers: 1 to 16384 [256]\n# max_viewers: 256\n"));
  EXPECT_EQ(read(printed, {"--print-config"}).exit_code, 0);
  EXPECT_EQ(out, printed);
  // Each example could stand there.
  std::string all;
  for (const Setting& setting : form().settings())
    all += setting.field->name() + ": " + setting.example + "\n";
  EXPECT_FALSE(read(all, {}).exit_code) << err;
}

TEST_F(Configuration, SharedOptionsSayTheSameInAllPrograms) {
  const Form relay(*idl::RelayConfig::descriptor());
  for (const char* name : {"session", "domain", "profile", "site", "metrics", "log_format", "log_level"}) {
    EXPECT_EQ(form().find(name)->text(), relay.find(name)->text());
    EXPECT_EQ(form().find(name)->text(), common(name).text());
  }
  for (const Form* each : {&form(), &relay})
    for (const Setting& setting : each->settings())
      EXPECT_FALSE(setting.help.empty() || setting.takes.empty() || setting.example.empty())
          << setting.field->full_name();
  read("log_format: \"json\" log_level: \"debug\" metrics: \"9730\"", {});
  EXPECT_TRUE(log_of(config).json);
  EXPECT_EQ(log_of(config).level, "debug");
  EXPECT_EQ(metrics_of(config)->value(), (metrics::Address{"127.0.0.1", 9730}));
  config.set_metrics("nowhere");
  EXPECT_THAT(metrics_of(config).error().message, HasSubstr("--metrics: must be PORT"));
}

TEST_F(Configuration, DefaultsAreThoseOfTheLibrary) {
  complete(form(), config);
  EXPECT_EQ(config.max_viewers(), gateway::Limits().viewers);
  EXPECT_EQ(config.queue_bytes(), gateway::Limits().queue_bytes);
  EXPECT_EQ(log_of(config).level, logging::LogOptions().level);
}

}  // namespace
}  // namespace tandem::configuration
