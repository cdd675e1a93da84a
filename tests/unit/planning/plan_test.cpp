#include "services/host/planning/plan.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "sdk/client/api/drawn_scene.hpp"
#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/rigid/constants.hpp"
#include "services/engines/scenes/replayed.hpp"
#include "services/engines/sessions/session_plan.hpp"

namespace tandem::planning {
namespace {

PlannedWorld balls_in_a_box() {
  PlannedWorld world{.name = "balls", .capacity = 1000, .dt_s = 1.0 / 60, .extent = 20, .threshold = 0.02};
  world.types.push_back({.name = "ball", .bounding_radius = 0.5, .contact_radius = 0.5});
  world.scenery.emplace();
  world.scenery->planes.push_back({.normal = {0, 1, 0}, .offset = -5});
  return world;
}

std::string refusal(const PlannedWorld& world, const Wishes& wishes = {}, const ServiceWishes& service = {}) {
  const auto planned = plan_server(world, wishes, service);
  return planned ? "accepted" : planned.error().message;
}

TEST(Plan, AWorldWithSceneryIsToldThinAndRich) {
  const auto config = plan_server(balls_in_a_box(), {}, {});
  ASSERT_TRUE(config) << config.error().message;
  ASSERT_EQ(host::encoding_offers(config->streams), 3U);
  EXPECT_EQ(config->streams[2].name, "hard");
  EXPECT_EQ(config->streams[2].offered, host::Offered::kOnceItPays);
  EXPECT_EQ(config->streams[0].name, "thin");
  EXPECT_EQ(config->streams[0].layout.predictor, "ballistic");
  EXPECT_EQ(config->streams[1].name, "rich");
  EXPECT_EQ(config->streams[1].offered, host::Offered::kWhileItPays);
  EXPECT_EQ(config->streams[1].layout.predictor, "field");
  const auto constants = read_contact_constants(config->streams[1].layout.predictor_constants);
  ASSERT_TRUE(constants);
  EXPECT_EQ(constants->planes.size(), 1U);
  EXPECT_NEAR(constants->types[0].radius * config->streams[1].lattice.unit, 0.5, 0.001);
}

TEST(Plan, AWorldOfBodiesThatTurnTriesRigid) {
  PlannedWorld world = balls_in_a_box();
  world.types[0].shape = BodyShape::kBox;
  world.types[0].shape_values = {0.3F, 0.3F, 0.3F};
  const auto names = [&world](const Wishes& wishes = {}) {
    const std::vector<StreamWishes> streams = usual_streams(world, wishes).value();
    std::string said;
    for (const StreamWishes& stream : streams)
      said += stream.name + (stream.offered == host::Offered::kOnceItPays ? "? " : " ");
    return said;
  };
  EXPECT_EQ(names(), "") << "they do not turn";
  world.turns = true;
  EXPECT_EQ(names(), "thin rigid? ");
  const auto config = plan_server(world, {}, {});
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_EQ(config->streams[1].layout.predictor, "rigid");
  EXPECT_EQ(config->streams[1].offered, host::Offered::kOnceItPays);
  world.capacity = 4000;
  EXPECT_EQ(names(), "thin rigid? ");
  world.capacity = 4001;
  EXPECT_EQ(names(), "") << "a trial would take too long";
  world.capacity = 1000;
  Wishes wishes;
  wishes.automatic = true;
  EXPECT_EQ(names(wishes), "") << "a stream that is steered to a rate takes that rate";
  wishes = {};
  wishes.codec = "entropy";
  EXPECT_EQ(names(wishes), "");
  world.scenery.reset();
  EXPECT_EQ(names(), "") << "nothing is known of what bodies meet";
}

TEST(Plan, ShapesBecomeSolids) {
  PlannedWorld world = balls_in_a_box();
  world.turns = true;
  const auto add = [&world](BodyShape shape, std::vector<float> values) {
    world.types.push_back({.name = "b", .bounding_radius = 2, .contact_radius = 0.5, .shape = shape});
    world.types.back().shape_values = std::move(values);
  };
  add(BodyShape::kBox, {1, 0.5F, 0.25F});
  add(BodyShape::kCapsule, {0.5F, 1});
  add(BodyShape::kCylinder, {0.5F, 1});
  add(BodyShape::kHull, {0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3});  // four points
  add(BodyShape::kHull, {});
  Wishes wishes;
  wishes.predictor = "rigid";
  const auto config = plan_server(world, wishes, {});
  ASSERT_TRUE(config) << config.error().message;
  const host::StreamConfig& stream = config->streams[0];
  EXPECT_TRUE(stream.layout.parameters.step.contacts.listed);
  const auto constants = read_rigid_constants(stream.layout.predictor_constants);
  ASSERT_TRUE(constants);
  EXPECT_EQ(constants->contact.substeps, 2);
  const auto expect = [&](std::size_t type, Solid::Kind kind, const engine::Vec3& size) {
    EXPECT_EQ(constants->solids[type].kind, kind) << type;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(constants->solids[type].size[i] * stream.lattice.unit, size[i], 0.001) << type;
  };
  expect(0, Solid::Kind::kRound, {0.5, 0, 0});
  expect(1, Solid::Kind::kBox, {1, 0.5, 0.25});
  expect(2, Solid::Kind::kRound, {0.5, 1, 0});
  for (const std::size_t type : {3U, 4U, 5U}) expect(type, Solid::Kind::kRound, {0, 0, 0});
  world.turns = false;
  EXPECT_NE(refusal(world, wishes).find("'rigid': needs bodies that turn"), std::string::npos);
}

TEST(Plan, WithoutSceneryBodiesFlyUntilTheyAreCorrected) {
  PlannedWorld world = balls_in_a_box();
  world.scenery.reset();
  const auto config = plan_server(world, {}, {});
  ASSERT_TRUE(config) << config.error().message;
  ASSERT_EQ(host::encoding_offers(config->streams), 1U);
  EXPECT_EQ(config->streams[0].layout.predictor, "ballistic");
  Wishes wishes;
  wishes.predictor = "field";
  EXPECT_NE(refusal(world, wishes).find("'field': needs a world with body types and scenery"),
            std::string::npos)
      << refusal(world, wishes);
}

TEST(Plan, SceneryThatIsNoGeometryIsRefusedWhereItIsNeeded) {
  Wishes wishes;
  wishes.predictor = "contact";
  const auto with = [&wishes](auto change) {
    PlannedWorld world = balls_in_a_box();
    change(world);
    return refusal(world, wishes);
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(with([](PlannedWorld&) {}), "accepted");
  EXPECT_EQ(with([](PlannedWorld& w) { w.scenery->between_bodies.spring = -1; }),
            "between bodies: spring -1, damping 1.5 and shear 1.5 must be finite and not negative");
  EXPECT_EQ(with([](PlannedWorld& w) {
              w.scenery->boxes = {{}, {.half = {1, 0, 1}}};
            }),
            "scenery: boxes[1]: its half sizes are (1, 0, 1), but must be above 0");
  EXPECT_EQ(with([](PlannedWorld& w) { w.scenery->balls.push_back({.radius = kNan}); }),
            "scenery: balls[0]: its radius is nan, but must be above 0");
  EXPECT_EQ(with([](PlannedWorld& w) { w.types[0].mass = 0; }),
            "body type 'ball': its mass is 0, but must be above 0");
  EXPECT_EQ(with([](PlannedWorld& w) { w.scenery->substeps = 17; }), "17 substeps, but 1 to 16 are allowed");
  EXPECT_NE(with([](PlannedWorld& w) { w.scenery->planes[0].normal = {0, 2, 0}; }), "accepted");
  EXPECT_NE(with([](PlannedWorld& w) { w.scenery->planes[0].offset = kNan; }), "accepted");
  EXPECT_NE(with([](PlannedWorld& w) { w.scenery->boxes.push_back({.axes = {}}); }), "accepted");
  EXPECT_NE(with([](PlannedWorld& w) { w.scenery->balls.push_back({.radius = 1e30}); }), "accepted");
  EXPECT_NE(with([](PlannedWorld& w) { w.scenery->between_bodies.spring = kNan; }), "accepted");
  EXPECT_NE(with([](PlannedWorld& w) { w.scenery->substeps = 0; }), "accepted");
  EXPECT_NE(with([](PlannedWorld& w) { w.types[0].mass = 0; }), "accepted");
  EXPECT_NE(with([](PlannedWorld& w) { w.types[0].contact_radius = 0; }), "accepted");
}

TEST(Plan, SceneryThatIsNoGeometryIsNotPassedOverInSilence) {
  PlannedWorld world = balls_in_a_box();
  world.scenery->planes[0].normal = {0, 2, 0};
  EXPECT_EQ(refusal(world), "scenery: planes[0]: its normal (0, 2, 0) has length 2, but must have 1");
  world.scenery->planes[0] = {.normal = {0, 1, 0}, .offset = -1e12};  // beyond every lattice: it flies freely
  EXPECT_EQ(refusal(world), "accepted");
}

// What a client makes of the session's text: the direction of an edge of a turned box.
api::Vector edge(const api::Solid& box, const api::Vector& v) {
  const auto& [x, y, z, w] = box.orientation;
  const api::Vector t{2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])};
  return {v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2],
          v[2] + w * t[2] + x * t[1] - y * t[0]};
}

TEST(Plan, SceneryWithoutADescriptionIsWhatClientsDraw) {
  PlannedWorld world = balls_in_a_box();
  const double s = std::sqrt(0.5);
  using Axes = decltype(Scenery::Box::axes);
  const std::vector<Axes> all{{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
                              {{{s, s, 0}, {-s, s, 0}, {0, 0, 1}}},
                              {{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}},
                              {{{0, 0, -1}, {s, s, 0}, {s, -s, 0}}},
                              {{{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}}},
                              {{{-0.36, -0.48, 0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}}},
                              {{{1, 0, 0}, {0, 0.6, 0.8}, {0, 0.8, -0.6}}}};  // the last two: left-handed
  for (const Axes& axes : all)
    world.scenery->boxes.push_back({.centre = {1, 2, 3}, .half = {1, 2, 3}, .axes = axes});
  world.scenery->balls.push_back({.centre = {4, 5, 6}, .radius = 0.25});
  const auto config = plan_server(world, {}, {});
  ASSERT_TRUE(config) << config.error().message;
  const auto seen = api::read_scene_json(config->scene_json);
  ASSERT_TRUE(seen) << seen.error().message;
  ASSERT_EQ(seen->solids.size(), 2 + all.size());
  EXPECT_EQ(seen->solids[0].centre, (api::Vector{0, -5, 0}));
  EXPECT_EQ(seen->solids[0].normal, (api::Vector{0, 1, 0}));
  for (std::size_t i = 0; i < all.size(); ++i) {
    const api::Solid& box = seen->solids[1 + i];
    EXPECT_EQ(box.centre, (api::Vector{1, 2, 3}));
    EXPECT_EQ(box.size, (api::Vector{2, 4, 6}));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      api::Vector along{};
      along[axis] = 1;
      const api::Vector drawn = edge(box, along);
      double cosine = 0;
      for (std::size_t k = 0; k < 3; ++k) cosine += drawn[k] * all[i][axis][k];
      EXPECT_NEAR(std::abs(cosine), 1, 1e-9) << "box " << i << ", edge " << axis;
    }
  }
  EXPECT_EQ(seen->solids.back().radius, 0.25);
  // It is protobuf's JSON mapping: what protobuf reads and prints again shows the same.
  const auto printed =
      api::read_scene_json(scenes::replayed(config->scene_json, {.length_s = 1, .frame_rate_hz = 1}));
  ASSERT_TRUE(printed) << printed.error().message;
  ASSERT_EQ(printed->solids.size(), seen->solids.size());
  for (std::size_t i = 0; i < seen->solids.size(); ++i) {
    EXPECT_EQ(printed->solids[i].centre, seen->solids[i].centre);
    EXPECT_EQ(printed->solids[i].normal, seen->solids[i].normal);
    EXPECT_EQ(printed->solids[i].size, seen->solids[i].size);
    EXPECT_EQ(printed->solids[i].orientation, seen->solids[i].orientation);
    EXPECT_EQ(printed->solids[i].radius, seen->solids[i].radius);
  }
  world.scene_json = R"({"bounds":{}})";
  EXPECT_EQ(plan_server(world, {}, {})->scene_json, R"({"bounds":{}})");
}

TEST(Plan, APredictorThatWouldTakeTooLongIsRefusedByNameOrPassedOver) {
  PlannedWorld world = balls_in_a_box();
  world.capacity = 100'000;
  world.scenery->substeps = 1;  // of which `field` is coded as `contact`
  EXPECT_EQ(plan_stream(world, {})->layout.predictor, "field");
  world.scenery->balls.resize(256, {.radius = 1});
  EXPECT_EQ(plan_stream(world, {})->layout.predictor, "ballistic");
  EXPECT_EQ(plan_stream(world, {})->local.encodes_as, "");
  Wishes wishes;
  wishes.predictor = "field";
  EXPECT_NE(refusal(world, wishes).find("'field' takes too long to step 100000 slots with 257 shapes"),
            std::string::npos)
      << refusal(world, wishes);
}

TEST(Plan, WishesThatDoNotGoTogetherAreRefusedWhoeverWishesThem) {
  const auto with = [](auto change) {
    Wishes wishes;
    ServiceWishes service;
    change(wishes, service);
    return refusal(balls_in_a_box(), wishes, service);
  };
  using W = Wishes;
  using S = ServiceWishes;
  EXPECT_EQ(with([](W& w, S&) { w.budget_bytes = 1; }), "budget: must be at least 64 bytes");
  const auto with_delays = [&](std::vector<double> delays_s) {
    return with([&](W& w, S&) { w.delays_s = std::move(delays_s); });
  };
  EXPECT_EQ(with_delays({0, 0.2}), "accepted");
  EXPECT_EQ(with_delays({1.5}), "delivery-delay: must be a time from 0 to 1 second");
  EXPECT_EQ(with_delays({0, -0.1}), "delivery-delay: must be a time from 0 to 1 second");
  EXPECT_EQ(with_delays({0, std::numeric_limits<double>::quiet_NaN()}),
            "delivery-delay: must be a time from 0 to 1 second");
  EXPECT_EQ(with_delays({0, 0.1, 0.2}), "delivery-delay: must be at most two times");
  EXPECT_EQ(with_delays({0.2, 0.2004}), "delivery-delay: must be two different times") << "in milliseconds";
  const auto with_stream = [&](const char* text) {
    return with([&](W& w, S&) { w.streams = {read_stream(text).value()}; });
  };
  EXPECT_EQ(with_stream("x:delay=1.5"), "stream x: delay must be a time from 0 to 1 second");
  EXPECT_EQ(with_stream("x:delay=0,0.1,0.2"), "stream x: delay must be at most two times");
  EXPECT_EQ(with_stream("x:delay=0,0"), "stream x: delay must be two different times");
  EXPECT_NE(with([](W& w, S&) { w.codec = "entropy", w.budget_bytes = 500; }), "accepted");
  EXPECT_EQ(with([](W& w, S&) { w.cap_kbit_s = 15; }), "cap: must be 16 to 10,000,000 kbit/s");
  EXPECT_EQ(with([](W& w, S&) { w.codec = "entropy", w.cap_kbit_s = 64; }),
            "cap: needs codec limited or tracker");
  EXPECT_NE(with([](W& w, S&) { w.automatic = true, w.target_mbit_per_s = 1, w.cap_kbit_s = 64; }),
            "accepted");
  EXPECT_NE(with([](W& w, S&) { w.streams = {read_stream("x:cap=1").value()}; }), "accepted");
  EXPECT_NE(with([](W& w, S&) { w.streams = {read_stream("x:codec=entropy,cap=64").value()}; }), "accepted");
  EXPECT_NE(with([](W& w, S&) { w.codec = "none", w.automatic = true; }), "accepted");
  EXPECT_NE(with([](W& w, S&) { w.max_error_m = 1; }), "accepted");
  EXPECT_NE(with([](W& w, S&) { w.automatic = true, w.target_mbit_per_s = 1e300; }), "accepted");
  EXPECT_NE(with([](W& w, S&) { w.automatic = true, w.target_mbit_per_s = 1e-9; }), "accepted");
  EXPECT_NE(with([](W& w, S&) { w.predictor = "rubbish", w.streams = {read_stream("x:ballistic").value()}; }),
            "accepted");
  EXPECT_EQ(with([](W& w, S&) { w.streams = {{"", {}}}; }), "every stream needs a name");
  EXPECT_NE(with([](W& w, S&) { w.streams = {read_stream("x:max-error=1").value()}; }), "accepted");
  EXPECT_NE(with([](W&, S& s) { s.client_limit = 100'000; }), "accepted");
  EXPECT_NE(with([](W&, S& s) { s.rate_hz = std::numeric_limits<double>::quiet_NaN(); }), "accepted");
}

TEST(Plan, AnApplicationsWorldIsPlannedAsTheSameScene) {
  const auto scene = scenes::load_scene("half_pipe").value();
  const PlannedWorld world = sessions::world_of(scene, 1000);
  sessions::SessionChoice choice;
  choice.bodies = 1000;
  const auto config = sessions::plan_session(scene, choice).value();
  const auto planned = plan_session(world, {}).value();
  ASSERT_EQ(planned.streams.size(), config.streams.size());
  EXPECT_EQ(planned.streams[0].lattice, config.streams[0].lattice);
  EXPECT_EQ(planned.streams[0].layout.predictor_constants, config.streams[0].layout.predictor_constants);
  EXPECT_EQ(planned.types.size(), scene.types.size());
}

TEST(Plan, EveryStreamOptionIsReadAndReachesItsStream) {
  Wishes wishes;
  wishes.streams = {
      read_stream("a:ballistic,codec=limited,threshold=0.04,budget=500,data=no,data_kbit_s=20").value(),
      read_stream("b:field,target-bandwidth=0.5,max-error=0.1,delay=0.2").value()};
  const auto config = plan_server(balls_in_a_box(), wishes, {.session = "s", .lead = 0, .window = 3});
  ASSERT_TRUE(config) << config.error().message;
  const host::StreamConfig &a = config->streams[0], &b = config->streams[1];
  EXPECT_EQ(a.layout.codec, "limited");
  EXPECT_EQ(a.budget, 500U);
  EXPECT_FALSE(a.has_data);
  EXPECT_EQ(a.data_kbit_s, 20);
  EXPECT_TRUE(b.has_data);
  EXPECT_NEAR(a.layout.parameters.codec.threshold * a.lattice.unit, 0.04, 1e-6);
  ASSERT_TRUE(b.quality);
  EXPECT_EQ(b.quality->target_mbit_per_s, 0.5);
  EXPECT_NEAR(b.quality->largest_threshold * b.lattice.unit, 0.1, 1e-3);
  EXPECT_EQ(b.layout.lead, 0U);
  EXPECT_EQ(a.delay_ms, 0U);
  EXPECT_EQ(b.delay_ms, 200U);
  EXPECT_EQ(config->session, "s");
  EXPECT_EQ(config->window, 3U);
}

// Name and delay of each offer.
std::string offers(const Wishes& wishes) {
  const auto config = plan_server(balls_in_a_box(), wishes, {});
  if (!config) return config.error().message;
  std::string text;
  for (const host::StreamConfig& offer : config->streams)
    text += offer.name + "@" + std::to_string(offer.delay_ms) + " ";
  return text;
}

std::vector<StreamWishes> streams_of(const std::string& names, const std::string& more = {}) {
  std::vector<StreamWishes> streams;
  for (const char name : names)
    streams.push_back(read_stream(std::string(1, name) + ":ballistic" + more).value());
  return streams;
}

TEST(Plan, EachStreamIsOfferedInTwoDelaysBehindAllThatEncode) {
  EXPECT_EQ(offers({}), "thin@0 rich@0 hard@0 thin@200 rich@200 hard@200 ");
  EXPECT_EQ(offers({.delays_s = {0.1}}), "thin@100 rich@100 hard@100 ");
  EXPECT_EQ(offers({.delays_s = {0.5, 0.1}, .streams = streams_of("a")}), "a@100 a@500 ");
  EXPECT_EQ(offers({.predictor = "ballistic"}), "@0 @200 ") << "one stream without a name";
  EXPECT_EQ(offers({.streams = streams_of("ab", ",delay=0.3")}), "a@300 b@300 ");
  EXPECT_EQ(offers({.delays_s = {0}, .streams = streams_of("a", ",delay=0,0.3")}), "a@0 a@300 ");
  const auto config = plan_server(balls_in_a_box(), {}, {});
  EXPECT_EQ(host::encoding_offer(config->streams, 4), 1U);
  EXPECT_TRUE(host::same_encoding(config->streams[1], config->streams[4]));
}

TEST(Plan, MoreThanEightOffersAreNotMadeUnlessSomebodyWantsThem) {
  EXPECT_EQ(offers({.streams = streams_of("abcd")}), "a@0 b@0 c@0 d@0 a@200 b@200 c@200 d@200 ");
  EXPECT_EQ(offers({.streams = streams_of("abcde")}), "a@0 b@0 c@0 d@0 e@0 ");
  EXPECT_EQ(offers({.delays_s = {0, 0.2}, .streams = streams_of("abcde")}),
            "delivery-delay: 5 streams in so many delays are 10 offers, and a session has 8");
  EXPECT_EQ(offers({.streams = streams_of("aa")}),
            "two streams are called 'a': every stream needs a name of its own");
}

TEST(Plan, UnderACapTheThresholdMayGrowFromTheStatedOne) {
  Wishes wishes;
  wishes.threshold_m = 0.04;
  wishes.streams = {read_stream("a:cap=64,delay=0.2").value(), read_stream("b:cap=100,max-error=0.1").value(),
                    read_stream("c:ballistic").value()};
  const auto config = plan_server(balls_in_a_box(), wishes, {});
  ASSERT_TRUE(config) << config.error().message;
  const auto metres = [&](std::size_t stream, std::int32_t units) {
    return units * config->streams[stream].lattice.unit;
  };
  EXPECT_EQ(config->streams[0].cap_kbit_s, 64U);
  ASSERT_TRUE(config->streams[0].quality && config->streams[1].quality);
  EXPECT_NEAR(metres(0, config->streams[0].layout.parameters.codec.threshold), 0.04, 1e-6);
  EXPECT_NEAR(metres(0, config->streams[0].quality->smallest_threshold), 0.04, 1e-6);
  EXPECT_NEAR(metres(0, config->streams[0].quality->largest_threshold), 64 * 0.04, 1e-3);
  EXPECT_NEAR(metres(1, config->streams[1].quality->largest_threshold), 0.1, 1e-3);
  EXPECT_EQ(config->streams[2].cap_kbit_s, 0U);
  EXPECT_FALSE(config->streams[2].quality);
}

TEST(Plan, AnUnknownStreamOptionIsRefusedInOneLine) {
  EXPECT_NE(read_stream("a:speed=3").error().message.find("unknown key 'speed'; known are codec, predictor"),
            std::string::npos);
  EXPECT_FALSE(read_stream("a:field,predictor=ballistic")) << "set twice";
  EXPECT_FALSE(read_stream("a:budget=1.5"));
}

}  // namespace
}  // namespace tandem::planning
