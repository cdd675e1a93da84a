// Wrong arguments that an application may pass.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "sdk/client/api/browsing/browsers.hpp"
#include "tests/support/playground/playground.hpp"

namespace tandem::api {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

class Arguments : public ::testing::Test {
 protected:
  Arguments() : client(playground.join()) {}
  ~Arguments() override { tandem_leave(client); }
  Arguments(const Arguments&) = delete;
  Arguments& operator=(const Arguments&) = delete;
  Arguments(Arguments&&) = delete;
  Arguments& operator=(Arguments&&) = delete;

  Playground playground;
  tandem_client client;
};

/// Every function that takes a client, with arguments that are right.
std::vector<tandem_result> call_all(tandem_client client) {
  const std::array<double, 3> vector{};
  tandem_status status = TANDEM_STATUS_INIT;
  tandem_event event = TANDEM_EVENT_INIT;
  tandem_scene scene = TANDEM_SCENE_INIT;
  tandem_body_type type = TANDEM_BODY_TYPE_INIT;
  std::size_t count = 0;
  return {tandem_update(client, 0),
          tandem_wait_until_playing(client, 0),
          tandem_prefer(client, "computing"),
          tandem_get_status(client, &status),
          tandem_sample(client, nullptr, nullptr, nullptr),
          tandem_next_event(client, &event),
          tandem_send_gravity(client, vector.data(), nullptr),
          tandem_send_push(client, vector.data(), 1, vector.data(), nullptr),
          tandem_send_bytes(client, nullptr, 0, nullptr),
          tandem_send_seek(client, 0, nullptr),
          tandem_get_scene(client, &scene),
          tandem_get_geometry(client, nullptr, 0, &count),
          tandem_get_type(client, 0, &type),
          tandem_get_type_values(client, 0, nullptr, 0, &count)};
}

TEST_F(Arguments, AHandleThatIsNotOneIsRefusedEverywhere) {
  ASSERT_EQ(tandem_leave(client), TANDEM_OK);
  for (const tandem_client handle : {client, tandem_client{0}, client + 1000, ~tandem_client{0}}) {
    for (const tandem_result result : call_all(handle)) EXPECT_EQ(result, TANDEM_INVALID_HANDLE);
    EXPECT_EQ(tandem_leave(handle), TANDEM_INVALID_HANDLE);
    EXPECT_EQ(tandem_browser_close(handle), TANDEM_INVALID_HANDLE);
    EXPECT_EQ(tandem_browser_list(handle, nullptr, 0, nullptr), TANDEM_INVALID_HANDLE);
  }
}

TEST_F(Arguments, AClientIsNoBrowser) {
  EXPECT_EQ(tandem_browser_close(client), TANDEM_INVALID_HANDLE);
  EXPECT_EQ(tandem_update(client, 0), TANDEM_OK);
}

TEST_F(Arguments, NoHandleIsUsedTwice) {
  const tandem_client other = playground.join();
  EXPECT_NE(other, client);
  tandem_leave(other);
  const tandem_client another = playground.join();
  EXPECT_NE(another, other);
  tandem_leave(another);
}

TEST_F(Arguments, NullPointersAreRefused) {
  ASSERT_EQ(tandem_wait_until_playing(client, 10), TANDEM_OK) << tandem_error_text();
  const std::array<double, 3> vector{};
  EXPECT_EQ(tandem_join(nullptr, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_browser_open(0, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_browser_open_with(nullptr, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_status(client, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_next_event(client, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_send_gravity(client, nullptr, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_send_push(client, nullptr, 1, vector.data(), nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_send_push(client, vector.data(), 1, nullptr, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_send_bytes(client, nullptr, 1, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_scene(client, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_type(client, 0, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_type_values(client, 0, nullptr, 1, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_geometry(client, nullptr, 1, nullptr), TANDEM_INVALID_ARGUMENT);
}

TEST_F(Arguments, OptionsOutOfRangeAreRefused) {
  const auto refused = [](auto&& change) {
    tandem_options options = TANDEM_OPTIONS_INIT;
    change(options);
    tandem_client none = 42;
    const bool right = tandem_join(&options, &none) == TANDEM_INVALID_ARGUMENT && none == 42;
    return right && *tandem_error_text() != '\0';
  };
  EXPECT_TRUE(refused([](auto& o) { o.domain = 231; }));
  EXPECT_TRUE(refused([](auto& o) { o.domain = UINT32_MAX; }));
  EXPECT_TRUE(refused([](auto& o) { o.session = ""; }));
  EXPECT_TRUE(refused([](auto& o) { o.session = "a*"; }));
  EXPECT_TRUE(refused([](auto& o) { o.role = 2; }));
  EXPECT_TRUE(refused([](auto& o) { o.role = -1; }));
  EXPECT_TRUE(refused([](auto& o) { o.lead = 9; }));
  EXPECT_TRUE(refused([](auto& o) { o.background = 2; }));
  EXPECT_TRUE(refused([](auto& o) { o.echo = 2; }));
  EXPECT_TRUE(refused([](auto& o) { o.threads = 65; }));
  EXPECT_TRUE(refused([](auto& o) { o.max_kbit_s = 1; }));
  EXPECT_TRUE(refused([](auto& o) { o.max_kbit_s = 10'000'001; }));
  EXPECT_TRUE(refused([](auto& o) { o.size = 0; }));
  EXPECT_TRUE(refused([](auto& o) { o.profile = "moon"; }));
  EXPECT_TRUE(refused([](auto& o) { o.profile = "wan"; }));
  tandem_browser none = 0;
  EXPECT_EQ(tandem_browser_open(231, &none), TANDEM_INVALID_ARGUMENT);
  tandem_options options = TANDEM_OPTIONS_INIT;
  options.profile = "wan";
  EXPECT_EQ(tandem_browser_open_with(&options, &none), TANDEM_INVALID_ARGUMENT);
  EXPECT_NE(std::string(tandem_error_text()).find("wan:server=ADDRESS"), std::string::npos);
}

TEST_F(Arguments, NumbersThatAreNoneAreRefused) {
  EXPECT_EQ(tandem_update(client, kNan), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_wait_until_playing(client, kNan), TANDEM_INVALID_ARGUMENT);
  ASSERT_EQ(tandem_wait_until_playing(client, 10), TANDEM_OK) << tandem_error_text();
  const std::array<double, 3> good{}, bad{0, kNan, 0}, far{0, kInfinity, 0};
  EXPECT_EQ(tandem_send_gravity(client, bad.data(), nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_send_gravity(client, far.data(), nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_send_push(client, good.data(), kNan, good.data(), nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_send_push(client, good.data(), 1, bad.data(), nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_send_seek(client, kNan, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_send_seek(client, kInfinity, nullptr), TANDEM_INVALID_ARGUMENT);
  const std::array<std::byte, 1025> bytes{};
  EXPECT_EQ(tandem_send_bytes(client, bytes.data(), bytes.size(), nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_send_bytes(client, bytes.data(), bytes.size() - 1, nullptr), TANDEM_OK);
  tandem_sample_options options = TANDEM_SAMPLE_OPTIONS_INIT;
  options.smoothing_s = kNan;
  EXPECT_EQ(tandem_sample(client, &options, nullptr, nullptr), TANDEM_INVALID_ARGUMENT);
  options.smoothing_s = 1000;
  EXPECT_EQ(tandem_sample(client, &options, nullptr, nullptr), TANDEM_INVALID_ARGUMENT);
  options = TANDEM_SAMPLE_OPTIONS_INIT;
  options.mode = 7;
  EXPECT_EQ(tandem_sample(client, &options, nullptr, nullptr), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_update(client, -kInfinity), TANDEM_OK);
}

TEST_F(Arguments, AFailureHasATextAndLeavesTheOutputsAlone) {
  std::uint64_t number = 42;
  const std::array<double, 3> vector{};
  EXPECT_EQ(tandem_send_gravity(client, vector.data(), &number), TANDEM_NOT_READY);
  EXPECT_EQ(number, 42U);
  EXPECT_NE(std::string(tandem_error_text()), "");
}

TEST_F(Arguments, AnObserverMaySendNothing) {
  tandem_options options = TANDEM_OPTIONS_INIT;
  options.role = TANDEM_OBSERVER;
  options.background = 0;
  tandem_client observer = 0;
  ASSERT_EQ(playground.join(&options, &observer), TANDEM_OK);
  ASSERT_EQ(tandem_wait_until_playing(observer, 10), TANDEM_OK) << tandem_error_text();
  const std::array<double, 3> vector{};
  EXPECT_EQ(tandem_send_gravity(observer, vector.data(), nullptr), TANDEM_OUT_OF_ORDER);
  tandem_leave(observer);
}

TEST_F(Arguments, WithoutASessionNothingIsKnownYet) {
  playground.stop_server();
  const tandem_client lonely = playground.join();
  EXPECT_EQ(tandem_wait_until_playing(lonely, 0.5), TANDEM_TIMEOUT);
  const auto results = call_all(lonely);
  EXPECT_EQ(results[0], TANDEM_OK);
  EXPECT_EQ(results[1], TANDEM_TIMEOUT);
  EXPECT_EQ(results[2], TANDEM_OK);
  EXPECT_EQ(results[3], TANDEM_OK);
  for (std::size_t i = 4; i < results.size(); ++i) EXPECT_EQ(results[i], TANDEM_NOT_READY) << i;
  tandem_leave(lonely);
}

struct InACallback {
  tandem_client client = 0;
  std::vector<tandem_result> results = {};
};

TEST_F(Arguments, ACallbackMayCallNothing) {
  InACallback inside;
  tandem_options options = TANDEM_OPTIONS_INIT;
  options.background = 0;
  options.user = &inside;
  options.log = [](void* user, tandem_log_level /*level*/, const char* line) {
    auto& in = *static_cast<InACallback*>(user);
    EXPECT_NE(std::string(line), "");
    in.results = call_all(in.client);
    in.results.push_back(tandem_leave(in.client));
    tandem_client other = 0;
    in.results.push_back(tandem_join(nullptr, &other));
    in.results.push_back(tandem_browser_list(1, nullptr, 0, nullptr));
    EXPECT_NE(std::string(tandem_error_text()), "");
  };
  ASSERT_EQ(playground.join(&options, &inside.client), TANDEM_OK);
  ASSERT_EQ(tandem_wait_until_playing(inside.client, 10), TANDEM_OK) << tandem_error_text();
  ASSERT_FALSE(inside.results.empty());
  for (const tandem_result result : inside.results) EXPECT_EQ(result, TANDEM_IN_CALLBACK);
  EXPECT_EQ(tandem_leave(inside.client), TANDEM_OK);
}

}  // namespace
}  // namespace tandem::api
