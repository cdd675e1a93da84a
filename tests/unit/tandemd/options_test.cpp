#include "services/tandemd/options.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/predict/contact/constants.hpp"
#include "services/sessions/session_plan.hpp"

namespace tandem::daemon {
namespace {

Settings least() {
  Settings settings;
  settings.scene = "cube";
  settings.bodies = 100;
  return settings;
}

std::string refusal(const std::function<void(Settings&)>& spoil) {
  Settings settings = least();
  spoil(settings);
  const auto options = check_settings(settings);
  return options ? "" : options.error().message;
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

TEST(Options, DefaultsAreThoseOfTheManual) {
  const auto options = check_settings(least());
  ASSERT_TRUE(options);
  EXPECT_EQ(options->session, "default");
  EXPECT_EQ(options->codec, "tracker");
  EXPECT_EQ(options->lead, 1U);
  EXPECT_FALSE(options->window);
  EXPECT_FALSE(options->free_rate);
  EXPECT_EQ(options->stall_timeout_s, 0.5);
  EXPECT_FALSE(options->duration_s);
  EXPECT_FALSE(options->budget_bytes);
}

TEST(Options, WordsAndNumbersAreBothUnderstood) {
  Settings settings = least();
  settings.window = "2";
  settings.rate = "max";
  settings.stall_timeout = "off";
  const auto words = check_settings(settings);
  ASSERT_TRUE(words);
  EXPECT_EQ(words->window, 2U);
  EXPECT_TRUE(words->free_rate);
  EXPECT_FALSE(words->stall_timeout_s);
  settings.window = "auto";
  settings.rate = "59.94";
  settings.stall_timeout = "1.5";
  const auto numbers = check_settings(settings);
  ASSERT_TRUE(numbers);
  EXPECT_FALSE(numbers->window);
  EXPECT_EQ(numbers->rate_hz, 59.94);
  EXPECT_EQ(numbers->stall_timeout_s, 1.5);
}

TEST(Options, EveryBadValueIsRefusedNamingItsFlag) {
  EXPECT_NE(refusal([](Settings& s) { s.scene.reset(); }).find("--scene"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) { s.bodies.reset(); }).find("--bodies"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) { s.bodies = 0; }).find("--bodies"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) { s.bodies = kMaxCapacity + 1; }).find("--bodies"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) { s.session = "a*"; }).find("--session"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) { s.session = ""; }).find("--session"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) { s.lead = 2; }).find("--lead"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) { s.domain = 231; }).find("--domain"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) { s.threads = 0; }).find("--threads"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) { s.client_limit = 0; }).find("--client-limit"), std::string::npos);
  for (const char* bad : {"0", "25", "-1", "2x", "", "automatic"}) {
    EXPECT_NE(refusal([bad](Settings& s) { s.window = bad; }).find("--window"), std::string::npos) << bad;
  }
  for (const char* bad : {"0", "1001", "nan", "inf", "30Hz", ""}) {
    EXPECT_NE(refusal([bad](Settings& s) { s.rate = bad; }).find("--rate"), std::string::npos) << bad;
  }
  for (const char* bad : {"0", "11", "nan", "never", "-1"}) {
    EXPECT_NE(refusal([bad](Settings& s) { s.stall_timeout = bad; }).find("--stall-timeout"),
              std::string::npos)
        << bad;
  }
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_NE(refusal([bad](Settings& s) { s.threshold = bad; }).find("--threshold"), std::string::npos)
        << bad;
    EXPECT_NE(refusal([bad](Settings& s) { s.threshold_scale = bad; }).find("--threshold-scale"),
              std::string::npos);
  }
  EXPECT_NE(refusal([](Settings& s) { s.duration = -1; }).find("--duration"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) { s.duration = std::nan(""); }).find("--duration"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) {
              s.codec = "entropy";
              s.budget_bytes = 1000;
            }).find("--budget"),
            std::string::npos);
  EXPECT_NE(refusal([](Settings& s) { s.budget_bytes = 63; }).find("--budget"), std::string::npos);
  EXPECT_NE(refusal([](Settings& s) {
              s.threshold = 1;
              s.threshold_scale = 1;
            }).find("--threshold-scale"),
            std::string::npos);
}

TEST(Options, OneWayToSetTheThresholdOnTheCommandLineDisplacesTheOtherInTheFile) {
  Settings flags = least(), file;
  file.threshold = 0.1;
  flags.threshold_scale = 2;
  EXPECT_TRUE(check_settings(overlay(flags, file)));
  EXPECT_FALSE(overlay(flags, file).threshold);
}

TEST(Options, AutomaticQualityHasItsOwnFlags) {
  const auto parse = [](std::vector<const char*> words) {
    words.insert(words.begin(), {"tandemd", "--scene", "cube", "--bodies", "10"});
    return parse_command_line(static_cast<int>(words.size()), words.data()).options;
  };
  const auto options = parse({"--threshold", "auto", "--target-bandwidth", "0.5", "--max-error", "0.2"});
  ASSERT_TRUE(options);
  EXPECT_TRUE(options->automatic);
  EXPECT_FALSE(options->threshold_m);
  EXPECT_DOUBLE_EQ(options->target_mbit_per_s, 0.5);
  EXPECT_DOUBLE_EQ(options->max_error_m.value_or(0), 0.2);
  EXPECT_FALSE(parse({"--threshold", "0.1"})->automatic);
  EXPECT_FALSE(parse({"--threshold", "much"}));
  EXPECT_FALSE(parse({"--target-bandwidth", "0.5"})) << "needs --threshold auto";
  EXPECT_FALSE(parse({"--threshold", "0.1", "--max-error", "0.2"}));
  EXPECT_FALSE(parse({"--threshold", "auto", "--target-bandwidth", "nan"}));
}

TEST(Options, AThresholdOnTheCommandLineDisplacesAutomaticQualityInTheFile) {
  Settings flags = least(), file;
  file.automatic = true;
  flags.threshold = 0.1;
  flags.automatic = false;  // as the command line sets it with a length
  const auto options = check_settings(overlay(flags, file));
  ASSERT_TRUE(options);
  EXPECT_FALSE(options->automatic);
}

TEST(Options, WhatDependedOnADisplacedChoiceInTheFileGoesWithIt) {
  Settings flags = least(), file;
  file.automatic = true;
  file.target_bandwidth = 1;
  file.max_error = 0.5;
  flags.threshold = 0.1;
  flags.automatic = false;
  EXPECT_TRUE(check_settings(overlay(flags, file)));
  flags = least();
  flags.codec = "none";
  EXPECT_TRUE(check_settings(overlay(flags, file)));
  flags.automatic = true;
  EXPECT_FALSE(check_settings(overlay(flags, file))) << "none has no threshold to choose";
  file = {};
  file.budget_bytes = 1000;
  flags = least();
  flags.codec = "entropy";
  EXPECT_TRUE(check_settings(overlay(flags, file)));
  flags.codec = "limited";
  EXPECT_EQ(overlay(flags, file).budget_bytes, 1000U);
}

TEST_F(ConfigFile, SetsWhatFlagsLeaveOpen) {
  write(
      "scene: \"cube\" bodies: 500 session: \"arena\" window: \"4\" scripted: true seed: 9 duration: 2.5\n");
  const std::string flag = "--config=" + path;
  const char* arguments[] = {"tandemd", flag.c_str(), "--bodies", "300", "--json"};
  const CommandLine command = parse_command_line(5, arguments);
  ASSERT_TRUE(command.options);
  EXPECT_EQ(command.options->scene, "cube");
  EXPECT_EQ(command.options->bodies, 300U) << "the flag wins";
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

TEST_F(ConfigFile, AFileThatIsNotThereIsAnError) {
  const auto missing = load_config(path + ".missing");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kIo);
}

TEST(CommandLineOf, UnknownFlagsAndMissingValuesAreUsageErrors) {
  const char* unknown[] = {"tandemd", "--scene", "cube", "--bodies", "5", "--fast"};
  EXPECT_EQ(parse_command_line(6, unknown).exit_code, 2);
  const char* word[] = {"tandemd", "--scene", "cube", "--bodies", "many"};
  EXPECT_EQ(parse_command_line(5, word).exit_code, 2);
  const char* nothing[] = {"tandemd"};
  EXPECT_EQ(parse_command_line(1, nothing).exit_code, 2);
  const char* help[] = {"tandemd", "--help"};
  const CommandLine shown = parse_command_line(2, help);
  EXPECT_FALSE(shown.options);
  EXPECT_EQ(shown.exit_code, 0);
}

TEST(SessionPlan, EveryCodecMakesASessionOfEveryPaperScene) {
  for (const char* name : {"half_pipe", "cube", "four_cubes", "half_pipe_2", "half_pipe_3"}) {
    const auto scene = scenes::load_scene(name);
    ASSERT_TRUE(scene) << scene.error().message;
    for (const char* codec : {"none", "selective", "quantized", "entropy", "limited"}) {
      sessions::SessionChoice choice;
      choice.bodies = 1000;
      choice.codec = codec;
      const auto config = sessions::plan_session(*scene, choice);
      ASSERT_TRUE(config) << config.error().message;
      EXPECT_EQ(config->types.size(), scene->types.size());
      EXPECT_EQ(config->scene, name);
      EXPECT_EQ(config->stream.budget, std::string(codec) == "limited" ? kPaperBudgetBytes : kNoBudget);
      EXPECT_EQ(config->stream.layout.parameters.codec.threshold, 1 << config->stream.lattice.halvings);
      const auto largest = sessions::largest_delta_bytes(config->stream);
      ASSERT_TRUE(largest) << largest.error().message;
      EXPECT_GT(*largest, 0U);
    }
  }
}

TEST(SessionPlan, ABudgetBindsTheCodecsThatServeWhoWaits) {
  const auto scene = scenes::load_scene("cube");
  ASSERT_TRUE(scene);
  sessions::SessionChoice choice;
  choice.bodies = 1000;
  EXPECT_EQ(sessions::plan_session(*scene, choice)->stream.budget, kNoBudget);
  choice.budget_bytes = 200;
  EXPECT_EQ(sessions::plan_session(*scene, choice)->stream.budget, 200U);
  choice.codec = "limited";
  EXPECT_EQ(sessions::plan_session(*scene, choice)->stream.budget, 200U);
  choice.codec = "entropy";
  EXPECT_EQ(sessions::plan_session(*scene, choice)->stream.budget, kNoBudget);
}

TEST(SessionPlan, ContactsTakeTheirConstantsFromEveryPaperScene) {
  for (const char* name : {"half_pipe", "cube", "four_cubes", "half_pipe_2", "half_pipe_3", "emitter"}) {
    SCOPED_TRACE(name);
    auto scene = scenes::load_scene(name);
    ASSERT_TRUE(scene) << scene.error().message;
    sessions::SessionChoice choice;
    choice.bodies = 1000;
    choice.codec = "tracker";
    choice.predictor = "contact";
    const auto config = sessions::plan_session(*scene, choice);
    ASSERT_TRUE(config) << config.error().message;
    EXPECT_TRUE(sessions::largest_delta_bytes(config->stream));
    const auto read = read_contact_constants(config->stream.layout.predictor_constants);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->substeps, static_cast<std::int32_t>(scene->world.substeps));
    EXPECT_EQ(read->planes.size(), scene->world.planes.size());
    EXPECT_NEAR(read->types[0].radius * config->stream.lattice.unit, scene->smallest_radius_m,
                config->stream.lattice.unit);
    scene->world.types.clear();  // as of a recorded trajectory
    EXPECT_FALSE(sessions::plan_session(*scene, choice));
  }
}

TEST(SessionPlan, FieldIsTheDefaultWhereItPays) {
  auto scene = scenes::load_scene("cube");
  ASSERT_TRUE(scene);
  const auto predictor = [&](const char* codec, std::uint32_t bodies) {
    sessions::SessionChoice choice;
    choice.bodies = bodies;
    choice.codec = codec;
    const auto config = *sessions::plan_session(*scene, choice);
    EXPECT_EQ(config.stream.layout.predictor_constants.empty(),
              config.stream.layout.predictor == "ballistic");
    return config.stream.layout.predictor;
  };
  EXPECT_EQ(predictor("tracker", 50000), "field");
  EXPECT_EQ(predictor("tracker", 50001), "ballistic");
  EXPECT_EQ(predictor("entropy", 1000), "ballistic");
  scene->world.types.clear();  // as of a recorded trajectory
  EXPECT_EQ(predictor("tracker", 1000), "ballistic");
}

TEST(SessionPlan, TheThresholdComesFromTheSceneUnlessChosen) {
  const auto scene = scenes::load_scene("cube");
  ASSERT_TRUE(scene);
  sessions::SessionChoice choice;
  choice.bodies = 1000;
  const auto threshold_m = [&] {
    const auto config = *sessions::plan_session(*scene, choice);
    return config.stream.layout.parameters.codec.threshold * config.stream.lattice.unit;
  };
  EXPECT_NEAR(threshold_m(), scene->threshold_m, 1e-9);
  choice.threshold_scale = 2;
  EXPECT_NEAR(threshold_m(), 2 * scene->threshold_m, 1e-9);
  choice.threshold_m = 0.25;
  EXPECT_NEAR(threshold_m(), 0.25, 1e-9);
  choice.threshold_m = 1e-12;
  EXPECT_FALSE(sessions::plan_session(*scene, choice));
}

}  // namespace
}  // namespace tandem::daemon
