// tandem::Server over DDS: mistakes that the author of a simulation may make, and how the server reports
// them.
#include "tandem/host.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

namespace tandem {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Two bodies that stand; takes no input.
class Standing : public engine::Simulation {
 public:
  [[nodiscard]] std::uint32_t capacity() const override { return 2; }
  [[nodiscard]] double dt_s() const override { return 0.01; }
  [[nodiscard]] engine::Vec3 gravity() const override { return pull; }
  void step() override {
    if (++steps == shrinks_at) zeros.resize(1);
    if (on_step) on_step();
  }
  [[nodiscard]] engine::Bodies bodies() const override {
    return {{zeros, zeros, zeros}, {zeros, zeros, zeros}, alive, types};
  }
  std::vector<float> zeros = std::vector<float>(2, 0);
  std::vector<std::uint8_t> alive = std::vector<std::uint8_t>(2, 1);
  std::vector<std::uint16_t> types = std::vector<std::uint16_t>(2, 0);
  int steps = 0, shrinks_at = 0;
  engine::Vec3 pull{};
  std::function<void()> on_step;
};

class ServerApi : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    ::setenv("CYCLONEDDS_URI",
             "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\" "
             "multicast=\"true\"/></Interfaces></General><Discovery><Tag>server-api-test</Tag></Discovery>"
             "</Domain></CycloneDDS>",
             1);
  }
  [[nodiscard]] ErrorCode refusal() {
    auto server = Server::start(options, standing);
    EXPECT_FALSE(server.has_value());
    return server ? ErrorCode{} : server.error().code;
  }
  Standing standing;
  ServerOptions options;
};

TEST_F(ServerApi, OptionsOutOfRangeAreRefused) {
  const auto with = [&](auto change) {
    options = {};
    change(options);
    return refusal();
  };
  EXPECT_EQ(with([](ServerOptions& o) { o.session = "a*"; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.domain = 231; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.threshold = 0; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.threshold = kNan; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.extent = 1e9; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.lead = 2; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.types.clear(); }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.types[0].name = std::string(65, 'x'); }),
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.target_mbit_per_s = kNan; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.codec = "zip"; }), ErrorCode::kUnsupported);
}

TEST_F(ServerApi, RefusalsAreInTheWordsOfTheOptions) {
  const auto with = [&](auto change) {
    options = {};
    change(options);
    auto server = Server::start(options, standing);
    return server ? "accepted" : server.error().message;
  };
  using O = ServerOptions;
  EXPECT_EQ(with([](O& o) { o.threshold = kNan; }), "the threshold must be above 0, not nan");
  EXPECT_EQ(with([](O& o) { o.extent = -1; }), "the extent must be above 0, not -1");
  EXPECT_EQ(with([](O& o) { o.extent = 1e6; }),
            "threshold 0.01 is too fine for an extent of 1e+06: with it, at least 0.954 is needed");
  EXPECT_EQ(with([](O& o) { o.max_error = 1; }), "max_error: needs automatic_threshold, or a cap");
  EXPECT_EQ(with([](O& o) { o.target_mbit_per_s = 1e-9; }),
            "target_mbit_per_s: must be from 0.001 to 1e6 Mbit/s");
  EXPECT_EQ(with([](O& o) { o.predictor = "oracle"; }),
            "unknown predictor 'oracle' (known: ballistic, rigid, hard, contact, field and auto)");
  EXPECT_EQ(with([](O& o) { o.predictor = "field"; }),
            "predictor 'field': needs a world with body types and scenery");
  EXPECT_EQ(with([](O& o) { o.stall_timeout_s = 11; }),
            "stall_timeout_s: must be 0.01 to 10 seconds, or off");
  EXPECT_EQ(with([](O& o) { o.rate_hz = -3; }), "rate_hz: must be 1 to 1000 Hz, or max");
  EXPECT_EQ(with([](O& o) { o.wait_for = 999; }), "wait_for: must be 0 to 256, as no more clients may come");
  EXPECT_EQ(with([](O& o) { o.budget_bytes = 1; }), "budget_bytes: must be at least 64 bytes");
  EXPECT_EQ(with([](O& o) { o.types[0].shape = BodyShape::kBox; }),
            "body type 'body': a box has 3 shape values, not 0");
  EXPECT_EQ(with([](O& o) { o.types[0].radius = kNan; }),
            "body type 'body': a radius is finite and not negative");
  EXPECT_EQ(with([](O& o) { o.scene_json = R"({"planes": [{"nromal": {"y": 1}}]})"; }),
            "scene_json: planes: there is no member 'nromal'; through, normal are drawn");
  EXPECT_EQ(with([](O& o) {
              o.scenery.emplace().planes.push_back({.normal = {0, 2, 0}});
            }),
            "scenery: planes[0]: its normal (0, 2, 0) has length 2, but must have 1");
  EXPECT_EQ(with([](O& o) { o.streams = {"thin"}; }),
            "'thin': must be NAME:PREDICTOR, or NAME:key=value,...");
  standing.pull = {0, kNan, 0};
  EXPECT_EQ(with([](O&) {}), "gravity is (0, nan, 0), but must be finite and at most 1.02e+05 along an axis");
}

TEST_F(ServerApi, AnExceptionOfTheSimulationIsAnErrorWithItsWords) {
  options.session = "throws";
  auto server = Server::start(options, standing);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  standing.on_step = [] { throw std::runtime_error("the springs broke"); };
  while (server->poll()) ASSERT_LT(standing.steps, 2);
  EXPECT_EQ(server->error().code, ErrorCode::kIo);
  EXPECT_EQ(server->error().message, "the simulation threw an exception: the springs broke");
  EXPECT_FALSE(server->poll());
}

/// Counts its steps, and can be saved.
class Counting final : public Standing {
 public:
  void save(std::vector<std::byte>& out) const override { out.push_back(static_cast<std::byte>(steps)); }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override {
    if (bytes.size() != 1) return false;
    steps = std::to_integer<int>(bytes[0]);
    return true;
  }
};

TEST_F(ServerApi, AServerGoesOnFromTheCheckpointOfTheOneBefore) {
  const std::string folder = ::testing::TempDir() + "tandem-server-api-" + std::to_string(::getpid());
  std::string log;
  options.checkpoint_dir = folder;
  options.log = [&log](std::string_view line) { log += line; };
  options.checkpoint_required = true;
  EXPECT_EQ(refusal(), ErrorCode::kUnsupported) << "a simulation without save()";
  Counting first;
  EXPECT_EQ(Server::start(options, first).error().code, ErrorCode::kIo) << "nothing to go on from";
  options.checkpoint_required = false;
  std::uint64_t last = 0;
  {
    auto server = Server::start(options, first);
    ASSERT_TRUE(server) << server.error().message;
    EXPECT_NE(log.find("starts afresh"), std::string::npos) << log;
    EXPECT_EQ(Server::start(options, standing).error().code, ErrorCode::kConflict)
        << "two servers of a folder";
    EXPECT_TRUE(server->run_for(1));
    EXPECT_GT(server->status().checkpoints, 0U);
    EXPECT_TRUE(server->status().checkpoint_age_s.has_value());
    last = server->status().frame;
  }
  options.checkpoint_required = true;
  Counting second;
  const auto server = Server::start(options, second);
  ASSERT_TRUE(server) << server.error().message;
  EXPECT_EQ(server->status().continues_frame, last) << "an orderly end loses nothing";
  EXPECT_EQ(server->status().frame, last);
  EXPECT_EQ(second.steps, static_cast<int>(last));
  std::filesystem::remove_all(folder);
}

TEST_F(ServerApi, WishesThatMakeNoStreamAreRefused) {
  const auto with = [&](auto change) {
    options = {};
    change(options);
    return refusal();
  };
  EXPECT_EQ(with([](ServerOptions& o) { o.predictor = "oracle"; }), ErrorCode::kUnsupported);
  EXPECT_EQ(with([](ServerOptions& o) { o.predictor = "field"; }), ErrorCode::kInvalidArgument)
      << "no scenery";
  EXPECT_EQ(with([](ServerOptions& o) { o.streams = {"thin"}; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.streams = {"a:oracle"}; }), ErrorCode::kUnsupported);
  EXPECT_EQ(with([](ServerOptions& o) {
              o.streams = {"a:ballistic", "a:ballistic"};
            }),
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.streams = {"a:threshold=-1"}; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.max_error = kNan; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.stall_timeout_s = kNan; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.rate_hz = kNan; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.threads = 0; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.delivery_delays_s = {2}; }), ErrorCode::kInvalidArgument);
  EXPECT_EQ(with([](ServerOptions& o) { o.window = 0; }), ErrorCode::kInvalidArgument);
}

TEST_F(ServerApi, StreamsOfDifferentPredictorsAreServedAtTheRateThatIsWished) {
  options.session = "streams";
  options.scenery.emplace();
  options.streams = {"thin:ballistic", "rich:field,threshold=0.02"};
  options.rate_hz = 200;
  auto started = Server::start(options, standing);
  ASSERT_TRUE(started.has_value()) << started.error().message;
  ASSERT_TRUE(started->run_for(1.5)) << started->error().message;
  EXPECT_GT(started->status().frame, 120U) << "100 a second is the simulation's own rate";
}

TEST_F(ServerApi, ASceneThatClientsCouldNotReadIsRefusedWithItsLine) {
  options.scene_json = "{\"gravity\": {\"y\": -9.81},\n\"boxes\": [{\"centre\": {\"x\": 1}}\n";
  auto server = Server::start(options, standing);
  ASSERT_FALSE(server.has_value());
  EXPECT_EQ(server.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(server.error().message, "scene_json: line 3: ',' or ']' is missing");
}

TEST_F(ServerApi, ColumnsThatAreNotOfTheCapacityAreRefused) {
  standing.zeros.resize(1);
  EXPECT_EQ(refusal(), ErrorCode::kInvalidArgument);
}

TEST_F(ServerApi, ItStepsAtTheSimulationsRateAndRefusesWhatTheSimulationDoes) {
  options.session = "standing";
  auto started = Server::start(options, standing);
  ASSERT_TRUE(started.has_value()) << started.error().message;
  Server server = std::move(*started);
  while (server.status().frame < 3) ASSERT_TRUE(server.poll());
  EXPECT_EQ(static_cast<std::uint64_t>(standing.steps), server.status().frame);
  EXPECT_EQ(server.status().participants, 0U);
  const auto refused = server.inject({.kind = 1, .values = {0, -9, 0}});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

TEST_F(ServerApi, ABodyBeyondTheExtentDisappearsAndTheLogSaysSo) {
  std::string told;
  options.session = "extent";
  options.extent = 5;
  options.log = [&](std::string_view line) { told += line; };
  standing.on_step = [&] { standing.zeros[1] = 18.8F; };
  auto server = Server::start(options, standing);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  for (int i = 0; i < 1000 && told.empty(); ++i) ASSERT_TRUE(server->poll());
  EXPECT_NE(told.find("slot 1 (its x is 18.8, beyond the extent, 5)"), std::string::npos) << told;
}

TEST_F(ServerApi, ColumnsThatShrinkEndTheSessionAndSayWhy) {
  options.session = "shrinking";
  standing.shrinks_at = 3;
  auto server = Server::start(options, standing);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  while (server->poll()) ASSERT_LT(standing.steps, 4);
  EXPECT_EQ(server->error().code, ErrorCode::kInvalidArgument);
  EXPECT_NE(server->error().message.find("column position[0] has 1 slots"), std::string::npos);
  EXPECT_EQ(server->status().frame, 2U);
  EXPECT_FALSE(server->run_for(1));
}

TEST_F(ServerApi, APollInsideAPollIsRefusedAndTheSessionGoesOn) {
  auto server = Server::start(options, standing);
  ASSERT_TRUE(server) << server.error().message;
  int refused = 0;
  standing.on_step = [&] {
    if (!server->poll(1) && server->error().code == ErrorCode::kOutOfOrder) ++refused;
    EXPECT_FALSE(server->run_for(1));
  };
  for (int i = 0; i < 10'000 && standing.steps < 5; ++i) ASSERT_TRUE(server->poll());
  EXPECT_EQ(refused, standing.steps);
  EXPECT_GE(standing.steps, 5);
}

TEST_F(ServerApi, TimesThatAreNoneAreNoTime) {
  options.session = "times";
  auto server = Server::start(options, standing);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  EXPECT_TRUE(server->poll(kNan));
  EXPECT_TRUE(server->poll(-std::numeric_limits<double>::infinity()));
  EXPECT_TRUE(server->run_for(kNan));
  EXPECT_TRUE(server->run_for(-1));
}

TEST_F(ServerApi, WhatAServerWasMovedFromHasEnded) {
  options.session = "moved";
  auto server = Server::start(options, standing);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  Server moved = std::move(*server);
  EXPECT_FALSE(server->poll());
  EXPECT_FALSE(server->run_for(1));
  EXPECT_EQ(server->error().code, ErrorCode::kOutOfOrder);
  EXPECT_EQ(server->inject({}).error().code, ErrorCode::kOutOfOrder);
  EXPECT_EQ(server->status().frame, 0U);
  EXPECT_TRUE(moved.poll());
  *server = std::move(moved);
  EXPECT_TRUE(server->poll());
}

TEST_F(ServerApi, ASecondServerOfASessionEndsAndSaysWhy) {
  options.session = "twice";
  std::string told;
  options.log = [&told](std::string_view line) { told += line; };
  auto first = Server::start(options, standing);
  ASSERT_TRUE(first.has_value());
  while (first->status().frame < 1) ASSERT_TRUE(first->poll());
  Standing other;
  auto second = Server::start(options, other);
  ASSERT_TRUE(second.has_value());
  bool goes_on = true;
  while (goes_on && second->status().frame == 0) {
    ASSERT_TRUE(first->poll(0));
    goes_on = second->poll(0.01);
  }
  EXPECT_FALSE(goes_on);
  EXPECT_EQ(second->error().code, ErrorCode::kConflict);
  EXPECT_FALSE(second->poll());
  EXPECT_EQ(other.steps, 0);
}

}  // namespace
}  // namespace tandem
