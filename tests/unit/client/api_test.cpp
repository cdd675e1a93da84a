// tandem::Client over DDS, without a server: what an application sees before anybody answers.
#include <gtest/gtest.h>

#include <cstdlib>
#include <thread>

#include "tandem/client.hpp"

namespace tandem {
namespace {

class ClientApi : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::string uri =
        "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\" "
        "multicast=\"true\"/>"
        "</Interfaces></General><Discovery><Tag>client-api-test</Tag></Discovery></Domain></CycloneDDS>";
    ::setenv("CYCLONEDDS_URI", uri.c_str(), 1);
  }
  ClientOptions options;
};

TEST_F(ClientApi, OptionsOutOfRangeAreRefused) {
  options.session = "a*";
  ASSERT_FALSE(Client::connect(options).has_value());
  EXPECT_EQ(Client::connect(options).error().code, ErrorCode::kInvalidArgument);
  options = {};
  options.domain = 231;
  EXPECT_FALSE(Client::connect(options).has_value());
  options = {};
  options.lead = 9;
  EXPECT_FALSE(Client::connect(options).has_value());
}

TEST_F(ClientApi, WithoutAServerItSearchesAndSaysNoToEverything) {
  for (const bool background : {false, true}) {
    options.background = background;
    options.session = "nobody";
    auto client = Client::connect(options);
    ASSERT_TRUE(client.has_value()) << client.error().message;
    EXPECT_FALSE(client->wait_until_playing(0.2));
    EXPECT_EQ(client->status().phase, ClientPhase::kSearching);
    EXPECT_FALSE(client->status().server_alive);
    EXPECT_NE(client->status().client_id, 0U);
    EXPECT_EQ(client->send_gravity({0, -9, 0}).error().code, ErrorCode::kOutOfOrder);
    EXPECT_FALSE(client->send_push({}, 1, {}).has_value());
    EXPECT_FALSE(client->send_bytes({}).has_value());
    Sample sample;
    EXPECT_FALSE(client->sample(sample));
    EXPECT_TRUE(client->types().empty());
    EXPECT_EQ(client->scene_description(), "");
  }
}

TEST_F(ClientApi, MayBeUsedFromSeveralThreadsAndMoved) {
  options.session = "nobody";
  auto connected = Client::connect(options);
  ASSERT_TRUE(connected.has_value());
  Client client = std::move(*connected);
  std::thread other([&client] {
    for (int i = 0; i < 200; ++i) EXPECT_EQ(client.status().phase, ClientPhase::kSearching);
  });
  Sample sample;
  for (int i = 0; i < 200; ++i) EXPECT_FALSE(client.sample(sample));
  other.join();
}

}  // namespace
}  // namespace tandem
