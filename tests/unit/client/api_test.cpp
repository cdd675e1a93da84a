// tandem::Client over DDS, without a server that one could play with: what an application sees before that.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <thread>

#include "sdk/transport/dds/dds_ports.hpp"
#include "tandem/client.hpp"
#include "tandem/eigen.hpp"
#include "tests/support/client/fake_server.hpp"

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
    EXPECT_EQ(client->wait_until_playing(0.2).error().code, ErrorCode::kTimeout);
    EXPECT_EQ(client->status()->phase, ClientPhase::kSearching);
    EXPECT_FALSE(client->status()->server_alive);
    EXPECT_NE(client->status()->client_id, 0U);
    EXPECT_EQ(client->send_gravity({0, -9, 0}).error().code, ErrorCode::kNotReady);
    EXPECT_FALSE(client->send_push({}, 1, {}).has_value());
    EXPECT_FALSE(client->send_bytes({}).has_value());
    EXPECT_EQ(client->send_seek(1).error().code, ErrorCode::kNotReady);
    Sample sample;
    EXPECT_FALSE(client->sample(sample));
    EXPECT_TRUE(client->types().empty());
  }
}

TEST_F(ClientApi, MayBeUsedFromSeveralThreadsAndMoved) {
  options.session = "nobody";
  auto connected = Client::connect(options);
  ASSERT_TRUE(connected.has_value());
  Client client = std::move(*connected);
  std::thread other([&client] {
    for (int i = 0; i < 200; ++i) EXPECT_EQ(client.status()->phase, ClientPhase::kSearching);
  });
  Sample sample;
  for (int i = 0; i < 200; ++i) EXPECT_FALSE(client.sample(sample));
  other.join();
}

TEST_F(ClientApi, ASampleDoesNotWaitForThePollInWork) {
  transport::DdsOptions dds;
  dds.session = options.session = "sampled";
  auto server = transport::make_dds_server_port(dds);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  transport::SessionMessage session;
  session.session = options.session;
  session.epoch = 1;
  session.capacity = 1;
  session.streams.emplace_back();
  session.lattice_unit = 1;  // the rest is nothing that one could play, which is worth a line in the log
  session.types = {{"ball", 1, 0, transport::Shape::kSphere, {}}};
  ASSERT_TRUE((*server)->write(session).has_value());

  Client* sampled = nullptr;
  int lines = 0;
  options.background = false;
  options.log = [&](LogLevel, std::string_view) {
    std::thread other([&] {
      Sample sample;
      EXPECT_FALSE(sampled->sample(sample));
    });
    other.join();  // update() goes on only when sample() has returned
    ++lines;
  };
  auto client = Client::connect(options);
  ASSERT_TRUE(client.has_value()) << client.error().message;
  sampled = &*client;
  Sample sample;
  EXPECT_FALSE(client->sample(sample));  // turns sampling on
  for (int i = 0; i < 200 && lines == 0; ++i) client->update(0.05);
  EXPECT_EQ(lines, 1);
  EXPECT_EQ(client->status()->phase, ClientPhase::kRefused);
}

TEST_F(ClientApi, AClientMayGoWithinTheLogFunctionOfAnother) {
  transport::DdsOptions dds;
  dds.session = options.session = "logged";
  auto server = transport::make_dds_server_port(dds);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  transport::SessionMessage session;
  session.session = options.session;
  session.epoch = 1;
  session.capacity = 1;
  session.streams.emplace_back();
  session.lattice_unit = 1;  // as above
  session.types = {{"ball", 1, 0, transport::Shape::kSphere, {}}};
  ASSERT_TRUE((*server)->write(session).has_value());

  std::optional<Client> gone;
  const auto told = std::make_shared<std::atomic<int>>(0);
  ClientOptions others = options;
  others.log = [told](LogLevel, std::string_view) { ++*told; };
  bool logged = false;
  options.background = false;
  options.log = [&](LogLevel, std::string_view) {
    gone.reset();
    logged = true;
  };
  auto client = Client::connect(options);
  auto other = Client::connect(others);
  ASSERT_TRUE(client && other);
  gone.emplace(std::move(*other));
  for (int i = 0; i < 200 && !logged; ++i) client->update(0.05);
  EXPECT_TRUE(logged);
  for (int i = 0; i < 200 && told.use_count() > 2; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(told.use_count(), 2)
      << "this one's and that in `others`: the client left, and its function is gone";
}

TEST_F(ClientApi, TypesTellWhatBodiesLookLike) {
  transport::DdsOptions dds;
  dds.session = options.session = "shaped";
  auto server = transport::make_dds_server_port(dds);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  transport::SessionMessage session = client::FakeServer(1, 4, 1).session;
  session.session = options.session;
  session.types = {{"plank", 2.5F, 0xFFU, transport::Shape::kBox, {1, 2, 0.5F}}};
  ASSERT_TRUE((*server)->write(session).has_value());
  options.background = false;
  auto client = Client::connect(options);
  ASSERT_TRUE(client.has_value()) << client.error().message;
  for (int i = 0; i < 200 && client->types().empty(); ++i) client->update(0.05);
  const auto types = client->types();
  ASSERT_EQ(types.size(), 1U);
  EXPECT_EQ(types[0].name, "plank");
  EXPECT_EQ(types[0].radius, 2.5F);
  EXPECT_EQ(types[0].colour_rgba, 0xFFU);
  EXPECT_EQ(types[0].shape, BodyShape::kBox);
  EXPECT_EQ(types[0].shape_values, (std::vector<float>{1, 2, 0.5F}));
}

TEST_F(ClientApi, ABrowserFindsTheSessionsOfADomain) {
  transport::DdsOptions dds;
  dds.session = "found";
  auto server = transport::make_dds_server_port(dds);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  transport::SessionMessage session = client::FakeServer(7, 4, 1).session;
  session.session = dds.session;
  ASSERT_TRUE((*server)->write(session).has_value());
  auto browser = Browser::open();
  ASSERT_TRUE(browser.has_value()) << browser.error().message;
  Result<std::vector<SessionInfo>> found;
  for (int i = 0; i < 200 && (!found || found->empty()); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    found = browser->sessions();
  }
  ASSERT_TRUE(found.has_value());
  ASSERT_EQ(found->size(), 1U);
  EXPECT_EQ(found->front().name, "found");
  EXPECT_EQ(found->front().epoch, 7U);
  EXPECT_EQ(found->front().capacity, 4U);
  EXPECT_TRUE(found->front().playable);
  EXPECT_FALSE(Browser::open(231).has_value());
}

TEST(EigenViews, ASampleIsAMatrixWithAColumnASlot) {
  Sample sample;
  sample.capacity = 3;
  sample.positions = {1, 2, 3, 40, 50, 60, 5, 6, 7};
  sample.alive = {1, 0, 1};
  EXPECT_EQ(positions(sample).col(2), Eigen::Vector3f(5, 6, 7));
  const Eigen::RowVectorXf weights = alive(sample).cast<float>().transpose();
  const Eigen::Vector3f mean = positions(sample) * weights.transpose() / weights.sum();
  EXPECT_EQ(mean, Eigen::Vector3f(3, 4, 5));
  EXPECT_EQ(positions(sample).data(), sample.positions.data()) << "a view, not a copy";
}

TEST(EigenViews, OrientationsAreQuaternionsInEigensOrder) {
  Sample sample;
  sample.capacity = 2;
  sample.positions.resize(6);
  sample.orientations = {0, 0, 0, 1, 0, 0, std::sqrt(0.5F), std::sqrt(0.5F)};
  ASSERT_TRUE(has_orientations(sample));
  EXPECT_EQ(orientations(sample).cols(), 2);
  EXPECT_EQ(orientations(sample).col(0), Eigen::Vector4f(0, 0, 0, 1));
  const Eigen::Vector3f turned = orientation(sample, 1) * Eigen::Vector3f::UnitX();
  EXPECT_TRUE(turned.isApprox(Eigen::Vector3f::UnitY())) << "a quarter turn about z, body to world";
  EXPECT_EQ(orientation(sample, 1).coeffs().data(), sample.orientations.data() + 4) << "a view, not a copy";
}

TEST(EigenViews, WithoutOrientationsThereIsNoColumn) {
  EXPECT_FALSE(has_orientations(Sample{}));
  EXPECT_EQ(orientations(Sample{}).cols(), 0);
}

TEST(EigenViews, AnEmptySampleIsAnEmptyMatrix) { EXPECT_EQ(positions(Sample{}).cols(), 0); }

}  // namespace
}  // namespace tandem
