#include "sdk/core/timeline/timeline.hpp"

#include <gtest/gtest.h>

#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

TimelineConfig config_for(std::string_view codec, std::uint32_t capacity) {
  TimelineConfig config;
  config.capacity = capacity;
  config.type_count = synthetic::kTypes;
  config.codec = codec;
  config.codec_tables = synthetic::tables_for(codec);
  config.parameters = {200, 16, 64};
  config.predictor = "ballistic";
  return config;
}

TEST(Timeline, AClientThatJoinsByASnapshotFollowsTheServer) {
  for (const std::string_view codec : codec_names()) {
    SCOPED_TRACE(codec);
    synthetic::Random random(2);
    const TimelineConfig config = config_for(codec, 300);
    auto server = ServerTimeline::create(config, 7);
    auto client = ClientTimeline::create(config);
    ASSERT_TRUE(server && client);
    server->start(0, synthetic::random_state(random, 300), Drive{{0, -640, 0}, 100, 0});
    std::vector<std::byte> snapshot;
    server->snapshot(snapshot);
    const auto loaded = client->load(snapshot, 7);
    ASSERT_TRUE(loaded) << loaded.error().message;
    for (int frame = 0; frame < 50; ++frame) {
      client->step(1);
      const auto delta = server->advance(synthetic::random_target(random, server->state(), 5), {});
      const auto applied = client->apply(delta.frame, delta.last_input, delta.hash, delta.payload);
      ASSERT_TRUE(applied) << applied.error().message;
      ASSERT_EQ(client->state(client->applied()), server->state());
    }
  }
}

}  // namespace
}  // namespace tandem
