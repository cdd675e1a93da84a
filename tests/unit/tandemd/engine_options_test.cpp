// Tests how an engine in another process is configured, and when it is started again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

#include "services/tandemd/configuration/config.hpp"
#include "services/tandemd/restarts.hpp"
#include "services/tandemd/served_world.hpp"

namespace tandem::daemon {
namespace {

using Config = idl::ServerConfig;
using ::testing::HasSubstr;

std::string refusal(const Config& config) {
  const auto options = check_config(config);
  return options ? "" : options.error().message;
}

TEST(EngineOptions, ComeInOneWayAndWithoutAScene) {
  Config config;
  config.set_engine("python3 boids.py");
  const auto options = check_config(config);
  ASSERT_TRUE(options.has_value()) << options.error().message;
  ASSERT_TRUE(options->engine.has_value());
  EXPECT_EQ(options->engine->command, "python3 boids.py");
  config.set_scene("cube");
  EXPECT_THAT(refusal(config), HasSubstr("leave out scene and bodies"));
  config.clear_scene();
  config.set_engine_fd(3);
  EXPECT_THAT(refusal(config), HasSubstr("comes in one way"));
  config.clear_engine_fd();
  config.set_engine("imd://node7:8888");
  EXPECT_THAT(refusal(config), HasSubstr("--topology"));
  const std::string file = ::testing::TempDir() + "it's.gro";
  config.set_topology(file);
  EXPECT_THAT(refusal(config), HasSubstr("--topology: " + file + ": cannot be read"));
  std::ofstream(file) << "water\n";
  EXPECT_EQ(check_config(config)->engine->command,
            "exec tandem-imd 'imd://node7:8888' --topology '" + ::testing::TempDir() + "it'\\''s.gro'");
  std::remove(file.c_str());
  config.set_engine("python3 boids.py");
  EXPECT_THAT(refusal(config), HasSubstr("--topology: belongs to --engine imd://"));
  config.clear_topology();
  config.set_engine_fd(3);
  config.clear_engine();
  EXPECT_EQ(check_config(config)->engine->descriptor, 3);
  config.set_engine_fd(70000);
  EXPECT_THAT(refusal(config), HasSubstr("--engine-fd"));
  config.clear_engine_fd();
  config.set_engine_socket("");
  EXPECT_THAT(refusal(config), HasSubstr("--engine-socket: is empty"));
  config.set_engine_socket("/run/engine");
  config.set_scripted(true);
  EXPECT_THAT(refusal(config), HasSubstr("only scenes have scripts"));
  config.set_scripted(false);
  config.set_standby(true);
  EXPECT_TRUE(check_config(config).has_value()) << "its engine loads what the live server's saves";
}

TEST(EngineOptions, ANetworkNeedsATokenThatNobodyElseReads) {
  Config config;
  config.set_engine_listen("127.0.0.1:0");
  EXPECT_THAT(refusal(config), HasSubstr("needs engine-token"));
  config.set_engine_listen("here:0");
  EXPECT_THAT(refusal(config), HasSubstr("--engine-listen: must be PORT"));
  config.set_engine_listen("127.0.0.1:0");
  const std::string path = ::testing::TempDir() + "engine_token_" + std::to_string(::getpid());
  config.set_engine_token(path);
  EXPECT_THAT(refusal(config), HasSubstr("cannot be read"));
  std::ofstream(path) << "a token of this test\n";
  ::chmod(path.c_str(), 0644);
  EXPECT_THAT(refusal(config), HasSubstr("everybody can read or write it"));
  ::chmod(path.c_str(), 0440);  // a credential of systemd 257
  EXPECT_THAT(refusal(config), HasSubstr("without blanks"));
  ::chmod(path.c_str(), 0600);
  EXPECT_THAT(refusal(config), HasSubstr("without blanks"));
  std::ofstream(path) << "0123456789abcdef\n";
  const auto options = check_config(config);
  ASSERT_TRUE(options.has_value()) << options.error().message;
  EXPECT_EQ(options->engine->token, "0123456789abcdef");
  EXPECT_EQ(options->engine->host, "127.0.0.1");
  std::remove(path.c_str());
  config.clear_engine_token();
  config.set_engine("srun engine");
  EXPECT_TRUE(check_config(config).has_value()) << "its command gets a token";
  config.clear_engine_listen();
  config.set_engine_token(path);
  EXPECT_THAT(refusal(config), HasSubstr("needs engine-listen"));
}

TEST(EngineWorld, HasWhatTheEngineSaid) {
  const auto hello = engine::door::parse_hello(
      "engine 1.0\nname pile\ncapacity 17\ndt 0.04\nup z\nturns 1\ntype a 2\ntype b 0.5\nplane 0 0 1 -2\nball 1 2 3 4\nnews events\n");
  ASSERT_TRUE(hello.has_value());
  const planning::PlannedWorld world = world_of(*hello);
  EXPECT_EQ(world.name, "pile");
  EXPECT_EQ(world.capacity, 17U);
  EXPECT_EQ(world.types.size(), 2U);
  EXPECT_EQ(world.threshold, 0.01);
  EXPECT_TRUE(world.tells.events && !world.tells.keys);
  EXPECT_FALSE(world.scenery.has_value()) << "no law was told, so contacts are not predicted";
  EXPECT_THAT(world.scene_json, HasSubstr(R"("planes":[{"through":{"x":-0,"y":-0,"z":-2},"normal")"));
  EXPECT_THAT(world.scene_json, HasSubstr("spheres"));
}

TEST(Restarts, WaitTwiceAsLongEachTimeAndGiveUp) {
  Restarts restarts;
  std::int64_t before_ns = 0;
  for (int i = 0; i < Restarts::kMaxInARow; ++i) {
    const auto wait_ns = restarts.wait_after_ns(0);
    ASSERT_TRUE(wait_ns.has_value());
    EXPECT_EQ(*wait_ns, i == 0 ? Restarts::kFirstWaitNs : std::min(2 * before_ns, Restarts::kLongestWaitNs));
    before_ns = *wait_ns;
  }
  EXPECT_FALSE(restarts.wait_after_ns(0).has_value());
  EXPECT_EQ(restarts.wait_after_ns(Restarts::kGoodNs), Restarts::kFirstWaitNs) << "it ran well";
}

}  // namespace
}  // namespace tandem::daemon
