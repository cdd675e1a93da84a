#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/workers/workers.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/tandemd/configuration/command_line.hpp"
#include "services/tandemd/configuration/config.hpp"

namespace tandem::daemon::of_options {
namespace {

using Config = idl::ServerConfig;

Config least() {
  Config config;
  config.set_scene("cube");
  config.set_bodies(100);
  return config;
}

std::string refusal(const std::function<void(Config&)>& spoil) {
  Config config = least();
  spoil(config);
  const auto options = check_config(config);
  return options ? "" : options.error().message;
}

TEST(Options, DefaultsAreThoseOfTheManual) {
  const auto options = check_config(least());
  ASSERT_TRUE(options);
  EXPECT_EQ(options->session, "default");
  EXPECT_EQ(options->choice.codec, "tracker");
  EXPECT_EQ(options->lead, 1U);
  EXPECT_FALSE(options->window);
  EXPECT_FALSE(options->free_rate);
  EXPECT_EQ(options->stall_timeout_s, 0.5);
  EXPECT_FALSE(options->duration_s);
  EXPECT_FALSE(options->choice.budget_bytes);
}

TEST(Options, WordsAndNumbersAreBothUnderstood) {
  Config config = least();
  config.set_window("2");
  config.set_rate("max");
  config.set_stall_timeout("off");
  const auto words = check_config(config);
  ASSERT_TRUE(words);
  EXPECT_EQ(words->window, 2U);
  EXPECT_TRUE(words->free_rate);
  EXPECT_FALSE(words->stall_timeout_s);
  config.set_window("auto");
  config.set_rate("59.94");
  config.set_stall_timeout("1.5");
  const auto numbers = check_config(config);
  ASSERT_TRUE(numbers);
  EXPECT_FALSE(numbers->window);
  EXPECT_EQ(numbers->rate_hz, 59.94);
  EXPECT_EQ(numbers->stall_timeout_s, 1.5);
}

TEST(Options, MetricsAreServedOnlyWhereAnAddressIsGiven) {
  Config config = least();
  EXPECT_FALSE(check_config(config)->metrics);
  config.set_metrics("9730");
  const auto options = check_config(config);
  ASSERT_TRUE(options && options->metrics);
  EXPECT_EQ(*options->metrics, (metrics::Address{"127.0.0.1", 9730}));
  for (const char* bad : {"", "host:1", "127.0.0.1:65536", "::1:80"}) {
    EXPECT_NE(refusal([bad](Config& s) { s.set_metrics(bad); }).find("--metrics"), std::string::npos) << bad;
  }
}

TEST(Options, EveryBadValueIsRefusedNamingItsFlag) {
  EXPECT_NE(refusal([](Config& s) { s.clear_scene(); }).find("--scene"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.clear_bodies(); }).find("--bodies"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_bodies(0); }).find("--bodies"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_bodies(kMaxCapacity + 1); }).find("--bodies"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_session("a*"); }).find("--session"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_session(""); }).find("--session"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_lead(2); }).find("--lead"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_domain(231); }).find("--domain"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_threads(0); }).find("--threads"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_threads(kMaxThreads + 1); }).find("--threads"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_client_limit(0); }).find("--client-limit"), std::string::npos);
  for (const char* bad : {"0", "25", "-1", "2x", "", "automatic"}) {
    EXPECT_NE(refusal([bad](Config& s) { s.set_window(bad); }).find("--window"), std::string::npos) << bad;
  }
  for (const char* bad : {"0", "1001", "nan", "inf", "30Hz", ""}) {
    EXPECT_NE(refusal([bad](Config& s) { s.set_rate(bad); }).find("--rate"), std::string::npos) << bad;
  }
  for (const char* bad : {"0", "11", "nan", "never", "-1"}) {
    EXPECT_NE(refusal([bad](Config& s) { s.set_stall_timeout(bad); }).find("--stall-timeout"),
              std::string::npos)
        << bad;
  }
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_NE(refusal([bad](Config& s) { s.set_threshold(bad); }).find("--threshold"), std::string::npos)
        << bad;
    EXPECT_NE(refusal([bad](Config& s) { s.set_threshold_scale(bad); }).find("--threshold-scale"),
              std::string::npos);
  }
  EXPECT_NE(refusal([](Config& s) { s.set_duration(-1); }).find("--duration"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_duration(std::nan("")); }).find("--duration"), std::string::npos);
  EXPECT_NE(refusal([](Config& s) {
              s.set_codec("entropy");
              s.set_budget_bytes(1000);
            }).find("--budget"),
            std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_budget_bytes(63); }).find("--budget"), std::string::npos);
  const auto of_delays = [](const std::vector<double>& delays_s) {
    return refusal([&](Config& s) {
      for (const double delay_s : delays_s) s.add_delivery_delay(delay_s);
    });
  };
  EXPECT_EQ(of_delays({-0.1}), "--delivery-delay: must be a time from 0 to 1 second");
  EXPECT_EQ(of_delays({0, 0.1, 0.2}), "--delivery-delay: must be at most two times");
  EXPECT_EQ(of_delays({0.2, 0.2}), "--delivery-delay: must be two different times");
  EXPECT_NE(refusal([](Config& s) {
              s.set_threshold(1);
              s.set_threshold_scale(1);
            }).find("--threshold-scale"),
            std::string::npos);
}

TEST(Options, CheckpointsHaveAFolderAnIntervalAndARule) {
  EXPECT_TRUE(check_config(least())->checkpoint.folder.empty()) << "none by default";
  Config config = least();
  config.set_checkpoint_dir("/var/lib/world");
  auto options = check_config(config);
  ASSERT_TRUE(options);
  EXPECT_EQ(options->checkpoint.folder, "/var/lib/world");
  EXPECT_EQ(options->checkpoint.interval_s, 1);
  EXPECT_FALSE(options->checkpoint.required);
  config.set_checkpoint("require");
  config.set_checkpoint_interval(0.5);
  options = check_config(config);
  ASSERT_TRUE(options);
  EXPECT_TRUE(options->checkpoint.required);
  EXPECT_EQ(options->checkpoint.interval_s, 0.5);
  config.set_checkpoint("off");
  EXPECT_TRUE(check_config(config)->checkpoint.folder.empty()) << "whatever else is said";
  EXPECT_NE(refusal([](Config& s) { s.set_checkpoint("require"); }).find("--checkpoint-dir"),
            std::string::npos);
  EXPECT_NE(refusal([](Config& s) { s.set_checkpoint("maybe"); }).find("--checkpoint"), std::string::npos);
  for (const double bad : {0.0, -1.0, 1e6, std::nan("")}) {
    EXPECT_NE(refusal([bad](Config& s) { s.set_checkpoint_interval(bad); }).find("--checkpoint-interval"),
              std::string::npos);
  }
}

TEST(Options, OneWayToSetTheThresholdOnTheCommandLineDisplacesTheOtherInTheFile) {
  Config flags = least(), file;
  file.set_threshold(0.1);
  flags.set_threshold_scale(2);
  EXPECT_TRUE(check_config(merge(flags, file)));
  EXPECT_FALSE(merge(flags, file).has_threshold());
}

TEST(Options, AutomaticQualityHasItsOwnFlags) {
  const auto parse = [](std::vector<const char*> words) {
    words.insert(words.begin(), {"tandemd", "--scene", "cube", "--bodies", "10"});
    return parse_command_line(static_cast<int>(words.size()), words.data()).options;
  };
  const auto options = parse({"--threshold", "auto", "--target-bandwidth", "0.5", "--max-error", "0.2"});
  ASSERT_TRUE(options);
  EXPECT_TRUE(options->choice.automatic);
  EXPECT_FALSE(options->choice.threshold_m);
  EXPECT_DOUBLE_EQ(options->choice.target_mbit_per_s, 0.5);
  EXPECT_DOUBLE_EQ(options->choice.max_error_m.value_or(0), 0.2);
  EXPECT_FALSE(parse({"--threshold", "0.1"})->choice.automatic);
  EXPECT_FALSE(parse({"--threshold", "much"}));
  EXPECT_FALSE(parse({"--target-bandwidth", "0.5"})) << "needs --threshold auto";
  EXPECT_FALSE(parse({"--threshold", "0.1", "--max-error", "0.2"}));
  EXPECT_FALSE(parse({"--threshold", "auto", "--target-bandwidth", "nan"}));
}

TEST(Options, AThresholdOnTheCommandLineDisplacesAutomaticQualityInTheFile) {
  Config flags = least(), file;
  file.set_threshold_auto(true);
  flags.set_threshold(0.1);
  flags.set_threshold_auto(false);  // as the command line sets it with a length
  const auto options = check_config(merge(flags, file));
  ASSERT_TRUE(options);
  EXPECT_FALSE(options->choice.automatic);
}

// A file's own mistake is no displaced choice.
TEST(Options, WhatDependsOnAutomaticQualityIsRefusedInAFileThatHasNone) {
  for (const auto set : {+[](Config& file) { file.set_target_bandwidth(1); },
                         +[](Config& file) { file.set_max_error(0.5); }}) {
    Config file = least();
    set(file);
    const auto options = check_config(merge({}, file));
    ASSERT_FALSE(options);
    EXPECT_NE(options.error().message.find("needs --threshold auto"), std::string::npos)
        << options.error().message;
    Config flags;
    flags.set_threshold_auto(true);
    EXPECT_TRUE(check_config(merge(flags, file)));
  }
}

// --secure "$DIR", where nobody set DIR.
TEST(Options, AnEmptyTextIsNotTakenForNone) {
  for (const auto set : {+[](Config& config) { config.set_secure(""); },
                         +[](Config& config) { config.set_checkpoint_dir(""); },
                         +[](Config& config) { config.set_profile(""); }}) {
    Config config = least();
    set(config);
    const auto options = check_config(config);
    ASSERT_FALSE(options);
    EXPECT_NE(options.error().message.find("is empty"), std::string::npos) << options.error().message;
  }
}

TEST(Options, WhatDependedOnADisplacedChoiceInTheFileGoesWithIt) {
  Config flags = least(), file;
  file.set_threshold_auto(true);
  file.set_target_bandwidth(1);
  file.set_max_error(0.5);
  flags.set_threshold(0.1);
  flags.set_threshold_auto(false);
  EXPECT_TRUE(check_config(merge(flags, file)));
  flags = least();
  flags.set_codec("none");
  EXPECT_TRUE(check_config(merge(flags, file)));
  flags.set_threshold_auto(true);
  EXPECT_FALSE(check_config(merge(flags, file))) << "none has no threshold to choose";
  file = {};
  file.set_budget_bytes(1000);
  flags = least();
  flags.set_codec("entropy");
  EXPECT_TRUE(check_config(merge(flags, file)));
  flags.set_codec("limited");
  EXPECT_EQ(merge(flags, file).budget_bytes(), 1000U);
}

TEST(CommandLineOf, UnknownFlagsAndMissingValuesAreUsageErrors) {
  const char* unknown[] = {"tandemd", "--scene", "cube", "--bodies", "5", "--fast"};
  EXPECT_EQ(parse_command_line(6, unknown).exit_code, 2);
  const char* word[] = {"tandemd", "--scene", "cube", "--bodies", "many"};
  EXPECT_EQ(parse_command_line(5, word).exit_code, 2);
  for (const char* seed : {"-1", "18446744073709551616", "1e5", ""}) {
    const char* wrong[] = {"tandemd", "--scene", "cube", "--bodies", "5", "--seed", seed};
    EXPECT_EQ(parse_command_line(7, wrong).exit_code, 2) << seed;
  }
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
      EXPECT_EQ(config->streams[0].budget, std::string(codec) == "limited" ? kPaperBudgetBytes : kNoBudget);
      EXPECT_EQ(config->streams[0].layout.parameters.codec.threshold,
                1 << config->streams[0].lattice.halvings);
      const auto largest = host::largest_delta_bytes(config->streams);
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
  EXPECT_EQ(sessions::plan_session(*scene, choice)->streams[0].budget, kNoBudget);
  choice.budget_bytes = 200;
  EXPECT_EQ(sessions::plan_session(*scene, choice)->streams[0].budget, 200U);
  choice.codec = "limited";
  EXPECT_EQ(sessions::plan_session(*scene, choice)->streams[0].budget, 200U);
  choice.codec = "entropy";
  EXPECT_EQ(sessions::plan_session(*scene, choice)->streams[0].budget, kNoBudget);
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
    EXPECT_TRUE(host::largest_delta_bytes(config->streams));
    const auto read = read_contact_constants(config->streams[0].layout.predictor_constants);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->substeps, static_cast<std::int32_t>(scene->world.substeps));
    EXPECT_EQ(read->planes.size(), scene->world.planes.size());
    EXPECT_NEAR(read->types[0].radius * config->streams[0].lattice.unit, scene->smallest_radius_m,
                config->streams[0].lattice.unit);
    scene->world.types.clear();  // as of a recorded trajectory
    EXPECT_FALSE(sessions::plan_session(*scene, choice));
  }
}

TEST(StreamOption, IsANameAndAPredictorOrKeysAndValues) {
  const auto plain = parse_stream("thin:ballistic");
  ASSERT_TRUE(plain) << plain.error().message;
  EXPECT_EQ(plain->name(), "thin");
  EXPECT_EQ(plain->predictor(), "ballistic");
  EXPECT_FALSE(plain->has_codec() || plain->has_threshold() || plain->has_budget_bytes());
  const auto all = parse_stream("coarse:predictor=field,codec=entropy,threshold=0.2");
  ASSERT_TRUE(all) << all.error().message;
  EXPECT_EQ(all->predictor(), "field");
  EXPECT_EQ(all->codec(), "entropy");
  EXPECT_EQ(all->threshold(), 0.2);
  const auto steered = parse_stream("m:ballistic,target-bandwidth=0.1,max-error=0.5,budget=900");
  ASSERT_TRUE(steered) << steered.error().message;
  EXPECT_EQ(steered->target_bandwidth(), 0.1);
  EXPECT_EQ(steered->max_error(), 0.5);
  EXPECT_EQ(steered->budget_bytes(), 900U);
  const auto late = parse_stream("late:delay=0,0.5,ballistic");
  ASSERT_TRUE(late) << late.error().message;
  EXPECT_EQ(late->predictor(), "ballistic");
  EXPECT_EQ(std::vector<double>(late->delivery_delay().begin(), late->delivery_delay().end()),
            (std::vector<double>{0, 0.5}));
  EXPECT_EQ(parse_stream("late:delay=0.3")->delivery_delay_size(), 1);
  EXPECT_EQ(parse_stream("m:cap=64").value().cap(), 64U);
  for (const char* wrong : {"", "thin", "thin:", ":", "a:b,", "a:,b", "a:b,c", "a:speed=3", "a:threshold=x",
                            "a:threshold=", "a:budget=-1", "a:predictor=b,c", "a:codec=", "a:threshold=1,2",
                            "a:delay=x", "a:delay="}) {
    const auto parsed = parse_stream(wrong);
    EXPECT_TRUE(!parsed || parsed->name().empty()) << wrong;
    if (parsed) continue;
    EXPECT_EQ(parsed.error().message.find('\n'), std::string::npos);
  }
}

TEST(StreamOption, WhatMakesNoSessionIsSaidInOneLine) {
  const auto says = [](
                        const std::vector<std::string>& streams, const std::string& text,
                        const std::function<void(Config&)>& more = [](Config&) {}) {
    const std::string said = refusal([&](Config& config) {
      for (const std::string& stream : streams) *config.add_stream() = parse_stream(stream).value();
      more(config);
    });
    EXPECT_NE(said.find(text), std::string::npos) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos);
  };
  says({"thin:ballistic", "thin:field"}, "two streams are called 'thin'");
  says({"Thin:ballistic"}, "a stream's name has 1 to 32");
  says({":ballistic"}, "every stream needs a name");
  says({"a:field", "b:field", "c:field", "d:field", "e:field", "f:field", "g:field", "h:field", "i:field"},
       "1 to 8 streams, not 9");
  says({"thin:ballistic", "rich:field"}, "--stream rich, which sets field",
       [](Config& config) { config.set_predictor("ballistic"); });
  says({"a:threshold=-1"}, "threshold must be a length from 1e-9 to 1e9 metres");
  says({"a:threshold=1,target-bandwidth=1"}, "threshold cannot be combined with target-bandwidth");
  says({"a:codec=none,target-bandwidth=1"}, "codec none has no threshold");
  says({"a:max-error=1"}, "max-error needs target-bandwidth");
  says({"a:codec=entropy,budget=900"}, "a budget needs codec");
  says({"a:codec=limited,budget=9"}, "at least 64 bytes");
  says({"a:delay=0,0.1,0.2"}, "--stream: a: delay must be at most two times");
  says({"a:delay=2"}, "--stream: a: delay must be a time from 0 to 1 second");
  says({"a:delay=0.2,0.2"}, "--stream: a: delay must be two different times");
  says({"a:codec=entropy,cap=64"}, "a cap needs codec");
  says({"a:cap=15"}, "cap must be 16 to 10,000,000 kbit/s");
}

TEST(StreamOption, OfTheCommandLineWinsOverTheFile) {
  Config file = least();
  *file.add_stream() = parse_stream("one:field").value();
  Config flags;
  EXPECT_EQ(merge(flags, file).stream_size(), 1);
  flags.set_predictor("contact");
  EXPECT_EQ(merge(flags, file).stream_size(), 0) << "a predictor for all";
  flags.Clear();
  *flags.add_stream() = parse_stream("two:ballistic").value();
  *flags.add_stream() = parse_stream("three:field").value();
  file.set_predictor("contact");
  const Config both = merge(flags, file);
  ASSERT_EQ(both.stream_size(), 2);
  EXPECT_EQ(both.stream(0).name(), "two");
  EXPECT_FALSE(both.has_predictor());
}

TEST(SessionPlan, StreamsShareTheLatticeOfTheFinestThreshold) {
  const auto scene = scenes::load_scene("cube");
  ASSERT_TRUE(scene);
  sessions::SessionChoice choice;
  choice.bodies = 1000;
  const auto length = [](double metres) { return std::to_string(metres); };
  choice.streams = {
      {"coarse",
       {{"codec", "entropy"}, {"predictor", "ballistic"}, {"threshold", length(4 * scene->threshold_m)}}},
      {"fine", {{"predictor", "field"}}}};
  const auto config = sessions::plan_session(*scene, choice);
  ASSERT_TRUE(config) << config.error().message;
  ASSERT_EQ(config->streams.size(), 2U);
  EXPECT_EQ(config->streams[0].lattice, config->streams[1].lattice);
  EXPECT_EQ(config->streams[0].layout.parameters.codec.threshold,
            4 * config->streams[1].layout.parameters.codec.threshold);
  EXPECT_EQ(config->streams[0].layout.codec, "entropy");
  EXPECT_EQ(config->streams[1].layout.predictor, "field");
  const auto refused = [&] {
    const auto planned = sessions::plan_session(*scene, choice);
    return planned ? std::string("accepted") : planned.error().message;
  };
  choice.streams[1].settings.emplace_back("threshold", "1e-9");
  EXPECT_EQ(refused().find("stream fine: threshold 1e-09 is too fine"), 0U) << refused();
  choice.streams[1].settings.back().second = length(scene->threshold_m);
  choice.streams[0].settings.back().second = "1e9";
  EXPECT_EQ(refused().find("stream coarse: threshold"), 0U) << refused();
  choice.streams[0].settings.pop_back();
  choice.streams[1].settings.front().second = "oracle";
  EXPECT_EQ(refused().find("stream fine: "), 0U) << refused();
}

TEST(SessionPlan, TheUsualStreamsAreThinAndRichWhereFieldPays) {
  using Settings = decltype(planning::StreamWishes::settings);
  const auto scene = scenes::load_scene("cube");
  ASSERT_TRUE(scene);
  sessions::SessionChoice choice;
  choice.bodies = 1000;
  const auto usual = [&] {
    return planning::usual_streams(sessions::world_of(*scene, choice.bodies), choice).value();
  };
  ASSERT_EQ(usual().size(), 3U);
  EXPECT_EQ(usual()[2].name, "hard");
  EXPECT_EQ(usual()[2].offered, host::Offered::kOnceItPays);
  EXPECT_EQ(usual()[0].offered, host::Offered::kAlways);
  EXPECT_EQ(usual()[1].offered, host::Offered::kWhileItPays);
  EXPECT_EQ(usual()[0].name, "thin");
  EXPECT_EQ(usual()[0].settings, Settings({{"predictor", "ballistic"}}));
  EXPECT_EQ(usual()[1].name, "rich");
  EXPECT_EQ(usual()[1].settings, Settings({{"predictor", "field"}}));
  choice.bodies = 20'001;
  EXPECT_EQ(usual().size(), 2U) << "a trial would take too long";
  EXPECT_EQ(usual()[1].offered, host::Offered::kAlways);
  choice.bodies = 1000;
  choice.automatic = true;
  EXPECT_EQ(usual().size(), 2U) << "a stream that is steered to a rate takes that rate";
  choice.automatic = false;
  choice.codec = "entropy";
  EXPECT_TRUE(usual().empty());
  choice.codec = "tracker";
  choice.predictor = "field";
  EXPECT_TRUE(usual().empty()) << "said";
  choice.predictor = "auto";
  choice.bodies = predictors().front().most_bodies + 1;
  EXPECT_TRUE(usual().empty());
}

TEST(SessionPlan, FieldIsTheDefaultWhereItPays) {
  auto scene = scenes::load_scene("cube");
  ASSERT_TRUE(scene);
  const auto predictor = [&](const char* codec, std::uint32_t bodies) {
    sessions::SessionChoice choice;
    choice.bodies = bodies;
    choice.codec = codec;
    const auto config = *sessions::plan_session(*scene, choice);
    EXPECT_EQ(config.streams[0].layout.predictor_constants.empty(),
              config.streams[0].layout.predictor == "ballistic");
    return config.streams[0].layout.predictor;
  };
  EXPECT_EQ(predictor("tracker", 1 << 20), "field");
  EXPECT_EQ(predictor("tracker", (1 << 20) + 1), "ballistic");
  EXPECT_EQ(predictor("entropy", 1000), "ballistic");
  for (const char* const largest : {"four_cubes", "half_pipe", "half_pipe_2", "half_pipe_3", "field"}) {
    scene = scenes::load_scene(largest);
    ASSERT_TRUE(scene);
    EXPECT_EQ(predictor("tracker", 1 << 20), "field") << largest;
  }
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
    return config.streams[0].layout.parameters.codec.threshold * config.streams[0].lattice.unit;
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
}  // namespace tandem::daemon::of_options
