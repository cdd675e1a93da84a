#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/workers/workers.hpp"
#include "services/host/host.hpp"
#include "services/host/planning/wishes.hpp"
#include "services/program/configuration/file.hpp"
#include "services/tandemd/configuration/command_line.hpp"
#include "services/tandemd/configuration/config.hpp"
#include "services/tandemd/configuration/form.hpp"
#include "services/tandemd/configuration/mistakes.hpp"
#include "services/tandemd/configuration/rehearsal.hpp"
#include "services/tandemd/configuration/reload.hpp"

namespace tandem::daemon {
namespace {

using Config = idl::ServerConfig;

std::string printed_form(const Config& config) { return configuration::print(form(), "tandemd", config); }

Config least() {
  Config config;
  config.set_scene("cube");
  config.set_bodies(100);
  return config;
}

class ConfigFile : public ::testing::Test {
 protected:
  ~ConfigFile() override { std::remove(path.c_str()); }
  void write(const std::string& text) const { std::ofstream(path) << text; }
  std::string path = (std::filesystem::temp_directory_path() /
                      ("tandem-options-" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
                       "-" + ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".textproto"))
                         .string();
};

TEST_F(ConfigFile, SetsWhatFlagsLeaveOpen) {
  write(
      "scene: \"cube\" bodies: 500 session: \"arena\" window: \"4\" scripted: true seed: 9 duration: 2.5\n");
  const std::string flag = "--config=" + path;
  const char* arguments[] = {"tandemd", flag.c_str(), "--bodies", "300", "--json"};
  const CommandLine command = parse_command_line(5, arguments);
  ASSERT_TRUE(command.options);
  EXPECT_EQ(command.options->scene, "cube");
  EXPECT_EQ(command.options->choice.bodies, 300U) << "the flag wins";
  EXPECT_EQ(command.options->session, "arena");
  EXPECT_EQ(command.options->window, 4U);
  EXPECT_TRUE(command.options->scripted);
  EXPECT_EQ(command.options->seed, 9U);
  EXPECT_EQ(command.options->duration_s, 2.5);
  EXPECT_TRUE(command.options->json);
}

TEST_F(ConfigFile, AMistakeIsNamedWithFileLineAndField) {
  write("scene: \"cube\"\nbodys: 500\n");
  const auto unknown = load_config(path);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::kMalformed);
  EXPECT_NE(unknown.error().message.find(path + ":2:"), std::string::npos) << unknown.error().message;
  EXPECT_NE(unknown.error().message.find("bodys"), std::string::npos) << unknown.error().message;
  write("bodies: \"many\"\n");
  EXPECT_FALSE(load_config(path));
}

TEST_F(ConfigFile, EveryMistakeNamesFileLineFieldAndWhatItTakes) {
  struct Mistake {
    const char *line, *field, *takes;
  };
  const std::vector<Mistake> mistakes = {
      {"client_limit: 70000", "client_limit", "1 to 65536"},
      {"client_limit: -5", "client_limit", "1 to 65536"},
      {"bodies: 99999999999", "bodies", "1 to 4194304"},
      {"bodies: 5000000", "bodies", "1 to 4194304"},
      {"rate: 30", "rate", "1 to 1000 Hz, or max"},
      {"rate: \"fast\"", "rate", "1 to 1000 Hz, or max"},
      {"lead: 2", "lead", "0 or 1"},
      {"window: \"25\"", "window", "1 to 24 frames, or auto"},
      {"codec: \"zip\"", "codec", "known: none, selective"},
      {"predictor: \"none\"", "predictor", "known: ballistic, rigid, hard, contact, field and auto"},
      {"threads: 65", "threads", "1 to 64"},
      {"domain: 231", "domain", "0 to 230"},
      {"stall_timeout: \"11\"", "stall_timeout", "0.01 to 10 seconds, or off"},
      {"checkpoint: \"maybe\"", "checkpoint", "auto, require or off"},
      {"checkpoint_interval: 0", "checkpoint_interval", "0.01 to 86400"},
      {"metrics: \"9730x\"", "metrics", "a port of 0 to 65535"},
      {"threshold: -1", "threshold", "a length from 1e-9 to 1e9 metres"},
      {"threshold_scale: 0", "threshold_scale", "1e-6 to 1e6"},
      {"duration: -1", "duration", "seconds"},
      {"budget_bytes: 3", "budget_bytes", "at least 64 bytes"},
      {"stream { name: \"a\" threshold: -1 }", "stream", "a: threshold must be a length from 1e-9"},
      {"delivery_delay: 1.5", "delivery_delay", "a time from 0 to 1 second"},
      {"delivery_delay: [0, 0.1, 0.2]", "delivery_delay", "at most two times"},
      {"delivery_delay: \"0,0.2\"", "delivery_delay", "one or two times from 0 to 1 second"},
      {"speed: 1", "speed", "--print-config shows all"},
  };
  for (const Mistake& mistake : mistakes) {
    SCOPED_TRACE(mistake.line);
    const bool bodies = std::string(mistake.field) == "bodies";
    write(std::string("scene: \"cube\"\n") + (bodies ? "\n" : "bodies: 10\n") + mistake.line + '\n');
    auto file = load_config(path);
    const auto options = file ? check_config(file->config, file->places) : tl::unexpected(file.error());
    ASSERT_FALSE(options);
    const std::string& said = options.error().message;
    EXPECT_EQ(said.find(path + ":3: field \"" + mistake.field + '"'), 0U) << said;
    EXPECT_NE(said.find(mistake.takes), std::string::npos) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos);
  }
}

TEST_F(ConfigFile, WhatIsMissingOrPlannedWronglyNamesTheFileToo) {
  write("bodies: 10\n");
  auto file = load_config(path);
  ASSERT_TRUE(file);
  EXPECT_EQ(
      check_config(file->config, file->places).error().message.find(path + ": field \"scene\" is missing"),
      0U);
  const auto said = [this](const std::string& text) {
    write(text);
    const auto read = load_config(path);
    const auto options = check_config(read->config, read->places);
    if (!options) return options.error().message;
    const auto good = rehearse(*options);
    return good ? std::string("good") : good.error().message;
  };
  EXPECT_EQ(said("scene: \"cube\"\nbodies: 10\n"), "good");
  EXPECT_EQ(
      said("bodies: 10\nscene: \"cub\"\n").find(path + ":2: field \"scene\": unknown scene \"cub\"; known: "),
      0U);
  EXPECT_EQ(said("scene: \"half_pipe\"\nbodies: 1000000\n").find(path + ":2: field \"bodies\": "), 0U);
  EXPECT_EQ(said("scene: \"cube\"\nbodies: 10\nthreshold: 1e-9\n")
                .find(path + ":3: field \"threshold\": threshold 1e-09 is too fine"),
            0U);
}

TEST_F(ConfigFile, CheckingNamesAllMistakesInTheOrderOfLines) {
  using ::testing::ElementsAre;
  using ::testing::HasSubstr;
  using ::testing::IsEmpty;
  using ::testing::StartsWith;
  const auto said = [this](const std::string& text, const Config& flags = {}) {
    write(text);
    std::vector<std::string> messages;
    for (const Error& error : find_mistakes(path, flags)) messages.push_back(error.message);
    return messages;
  };
  const auto at = [this](int line, const std::string& field) {
    return StartsWith(path + ":" + std::to_string(line) + ": field \"" + field + '"');
  };
  EXPECT_THAT(said("scene: \"cube\"\nbodies: 10\n"), IsEmpty());
  EXPECT_THAT(
      said("scene: \"cub\"\n"
           "bodys: 10  # no such field\n"
           "client_limit: 70000\n"
           "metrics: 9730\n"
           "stream { name: \"a\" threshold: -1 }\n"
           "stream { name: \"b\" predictor: \"none\" }\n"
           "checkpoint_interval: -1\n"
           "metrics: \"9730x\"\n"),
      ElementsAre(at(1, "scene"), at(2, "bodys"), at(3, "client_limit"), at(4, "metrics"), at(5, "stream"),
                  at(6, "stream"), at(7, "checkpoint_interval"), HasSubstr("\"bodies\" is missing")))
      << "a second `metrics` was left out: the first one was wrong";
  EXPECT_THAT(said("scene: cube\nbodies: 10\n"), ElementsAre(at(1, "scene"))) << "it is not missing, too";
  EXPECT_THAT(said("scene: \"cube\" bodies: 10\nengine_listen: \"nowhere\"\nengine_token: \"none\"\n"),
              ElementsAre(at(2, "engine_listen")));
  EXPECT_THAT(said("scene: \"cube\" bodies: many\nlead: 2\n"), ElementsAre(at(1, "bodies")))
      << "what else is in that line is not known";
  EXPECT_THAT(said("scene: \"half_pipe\"\nbodies: 1000000\n"), ElementsAre(at(2, "bodies")))
      << "the scene is checked when all else is good";
  Config flags;
  flags.set_lead(2);
  EXPECT_THAT(said("scene: \"cube\"\nbodies: 10\nlead: 3\nwindow: \"99\"\n", flags),
              ElementsAre(at(4, "window"), StartsWith("--lead: ")));
  EXPECT_THAT(find_mistakes(path + ".missing", {}), ::testing::SizeIs(1));
  EXPECT_THAT(find_mistakes("", flags), ::testing::SizeIs(::testing::Ge(1)));
}

// Whatever it names of this machine.
TEST_F(ConfigFile, CheckingRefusesWhatAStartRefuses) {
  const std::string nowhere = path + ".missing/folder";
  for (const std::string& field :
       {"checkpoint_dir: \"" + nowhere + "\"", "checkpoint_dir: \"" + path + "\"",
        "hash_log: \"" + nowhere + "\"", std::string("profile: \"lan:interface=nowhere0\""),
        std::string("metrics: \"203.0.113.7:9730\""), "secure: \"" + nowhere + "\""}) {
    write("scene: \"cube\"\nbodies: 10\n" + field + "\n");
    const auto mistakes = find_mistakes(path, {});
    ASSERT_EQ(mistakes.size(), 1U) << field;
    EXPECT_EQ(mistakes[0].message.find(path + ":3: field \"" + field.substr(0, field.find(':'))), 0U)
        << mistakes[0].message;
  }
  const std::string folder = path + ".folder";
  write("scene: \"cube\"\nbodies: 10\ncheckpoint_dir: \"" + folder + "\"\nhash_log: \"" + path +
        ".hashes\"\nmetrics: \"0\"\n");
  EXPECT_THAT(find_mistakes(path, {}), ::testing::IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(folder)) << "a check makes nothing";
  EXPECT_FALSE(std::filesystem::exists(path + ".hashes"));
}

TEST_F(ConfigFile, AFlagThatOverridesALineIsNamedInstead) {
  write("scene: \"cube\"\nbodies: 10\nclient_limit: 7\n");
  auto file = load_config(path);
  ASSERT_TRUE(file);
  Config flags;
  flags.set_client_limit(0);
  const auto options =
      check_config(merge(flags, file->config), configuration::places_beside(flags, std::move(file->places)));
  ASSERT_FALSE(options);
  EXPECT_EQ(options.error().message, "--client-limit: must be 1 to 65536");
}

TEST_F(ConfigFile, WhatIsPrintedIsReadAgain) {
  Config config = least();
  config.set_session("arena");
  config.set_rate("max");
  config.set_threshold(0.1);
  config.add_delivery_delay(0);
  config.add_delivery_delay(0.3);
  *config.add_stream() = parse_stream("thin:ballistic,budget=900,delay=0,0.5").value();
  *config.add_stream() = parse_stream("rich:field").value();
  const std::string printed = printed_form(config);
  write(printed);
  const auto file = load_config(path);
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(printed_form(file->config), printed);
  EXPECT_EQ(file->config.SerializeAsString(), config.SerializeAsString());
  // What is a comment is a line that could stand there.
  std::string all;
  std::istringstream lines(printed_form({}));
  for (std::string line; std::getline(lines, line);) {
    const std::string field = line.substr(0, line.find(':')).substr(line.starts_with("# ") ? 2 : 0);
    const bool is_stream = line.starts_with("# stream {");
    if (is_stream ||
        (form().find(field) != nullptr && line == "# " + field + ": " + form().find(field)->example))
      all += line.substr(2) + '\n';
  }
  write(all);
  const auto examples = load_config(path);
  ASSERT_TRUE(examples) << examples.error().message;
  std::vector<const google::protobuf::FieldDescriptor*> set;
  examples->config.GetReflection()->ListFields(examples->config, &set);
  EXPECT_EQ(set.size(), static_cast<std::size_t>(Config::descriptor()->field_count()));
}

TEST_F(ConfigFile, ReadAgainItSaysWhatChangesLiveAndWhatNeedsARestart) {
  using ::testing::ElementsAre;
  using ::testing::IsEmpty;
  const std::string common = "scene: \"cube\" bodies: 10 ";
  write(common + "client_limit: 7");
  Config flags;
  flags.set_seed(3);
  Rereader rereader(path, flags, merge(flags, load_config(path)->config));
  const auto nothing = rereader.read();
  ASSERT_TRUE(nothing);
  EXPECT_THAT(nothing->live, IsEmpty());
  EXPECT_THAT(nothing->after_restart, IsEmpty());

  write("scene: \"cube\" bodies: 20 client_limit: 9 stall_timeout: \"off\" checkpoint_interval: 5 seed: 4");
  const auto much = rereader.read();
  ASSERT_TRUE(much) << much.error().message;
  EXPECT_THAT(much->live, ElementsAre("stall_timeout", "client_limit", "checkpoint_interval"));
  EXPECT_THAT(much->after_restart, ElementsAre("bodies")) << "a flag keeps its effect";
  EXPECT_EQ(much->client_limit, 9U);
  EXPECT_FALSE(much->stall_timeout_s);
  EXPECT_EQ(much->checkpoint_interval_s, 5);

  write("scene: \"cube\"\nbodies: 20\nclient_limit: 0\n");
  const auto wrong = rereader.read();
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().message.find(path + ":3: field \"client_limit\""), 0U) << wrong.error().message;

  write("scene: \"cube\" bodies: 20 client_limit: 9");
  const auto back = rereader.read();
  ASSERT_TRUE(back);
  EXPECT_THAT(back->live, ElementsAre("stall_timeout", "checkpoint_interval")) << "the defaults again";
  EXPECT_THAT(back->after_restart, ElementsAre("bodies")) << "as long as it was not restarted";
  EXPECT_EQ(back->stall_timeout_s, 0.5);
}

TEST(Form, EveryFieldSaysWhatItMeansAndTakes) {
  for (const configuration::Setting& setting : form().settings())
    EXPECT_FALSE(setting.help.empty() || setting.takes.empty() || setting.example.empty())
        << setting.field->name();
}

// The library has them, too: for servers that have no configuration.
TEST(Form, DefaultsAndRangesAreThoseOfTheLibrary) {
  const auto options = check_config(least());
  ASSERT_TRUE(options);
  const planning::ServiceWishes service;
  EXPECT_EQ(options->session, service.session);
  EXPECT_EQ(options->lead, service.lead);
  EXPECT_EQ(options->client_limit, service.client_limit);
  EXPECT_EQ(options->wait_for, service.wait_for);
  EXPECT_EQ(options->window, service.window);
  EXPECT_EQ(options->stall_timeout_s, service.stall_timeout_s);
  const planning::Wishes wishes;
  EXPECT_EQ(options->choice.codec, wishes.codec);
  EXPECT_EQ(options->choice.predictor, wishes.predictor);
  EXPECT_EQ(options->choice.threshold_scale, wishes.threshold_scale);
  EXPECT_EQ(options->choice.threads, wishes.threads);
  EXPECT_EQ(options->checkpoint.interval_s, checkpoint::Settings().interval_s);
  EXPECT_EQ(form().find("bodies")->most, engine::kMaxBodies);
  EXPECT_EQ(form().find("domain")->most, transport::kMaxDomain);
  EXPECT_EQ(form().find("threads")->most, kMaxThreads);
  EXPECT_EQ(form().find("client_limit")->most, planning::kMaxClients);
  EXPECT_EQ(form().find("budget_bytes")->least, planning::kLeastBudgetBytes);
  EXPECT_EQ(form().find("window")->most, host::ServiceConfig().window_ceiling);
  EXPECT_EQ(form().find("checkpoint_interval")->least, checkpoint::kLeastIntervalS);
  EXPECT_EQ(form().find("checkpoint_interval")->most, checkpoint::kMaxIntervalS);
}

TEST_F(ConfigFile, AFileThatIsNotThereIsAnError) {
  const auto missing = load_config(path + ".missing");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kIo);
}

TEST_F(ConfigFile, ADirectoryIsAnErrorThatNamesIt) {
  const auto folder = load_config("/tmp");
  ASSERT_FALSE(folder);
  EXPECT_EQ(folder.error().code, ErrorCode::kIo);
  EXPECT_NE(folder.error().message.find("/tmp: cannot be read"), std::string::npos);
}

}  // namespace
}  // namespace tandem::daemon
