// The sessions on a domain, as a browser lists them.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "sdk/client/api/browsing/browsers.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::api {
namespace {

/// The test supplies announcements and status.
class FakeMonitor final : public transport::Monitor {
 public:
  struct Domain {
    std::vector<transport::Received<transport::SessionMessage>> sessions = {};
    std::vector<transport::Stamped<transport::ServerStatusMessage>> statuses = {};
  };
  explicit FakeMonitor(Domain& domain) : domain_(domain) {}
  void list_sessions(std::vector<transport::Received<transport::SessionMessage>>& out) override {
    out = domain_.sessions;
  }
  void take(std::vector<transport::Stamped<transport::ServerStatusMessage>>& out) override {
    out = std::exchange(domain_.statuses, {});
  }
  void take(std::vector<transport::Stamped<transport::ClientStatusMessage>>& /*out*/) override {}
  std::optional<transport::Peer> describe(const transport::ParticipantId& /*client*/) override {
    return std::nullopt;
  }
  Result<void> write(const transport::CommandMessage& /*message*/) override { return {}; }
  void wait(std::chrono::nanoseconds /*timeout*/) override {}

 private:
  Domain& domain_;
};

class Browsing : public ::testing::Test {
 protected:
  Browsing() { EXPECT_EQ(browse_over(std::make_unique<FakeMonitor>(domain), &browser), TANDEM_OK); }
  ~Browsing() override { EXPECT_EQ(tandem_browser_close(browser), TANDEM_OK); }
  Browsing(const Browsing&) = delete;
  Browsing& operator=(const Browsing&) = delete;
  Browsing(Browsing&&) = delete;
  Browsing& operator=(Browsing&&) = delete;

  void announce(const std::string& name, transport::SessionMessage session = client::FakeServer(5).session) {
    session.session = name;
    domain.sessions.push_back(client::from_server(session));
  }
  std::vector<tandem_session_info> list() const {
    std::vector<tandem_session_info> sessions(8, TANDEM_SESSION_INFO_INIT);
    std::size_t count = 0;
    EXPECT_EQ(tandem_browser_list(browser, sessions.data(), sessions.size(), &count), TANDEM_OK);
    sessions.resize(count);
    return sessions;
  }

  FakeMonitor::Domain domain;
  tandem_browser browser = 0;
};

TEST_F(Browsing, AnEmptyDomainIsAnEmptyList) { EXPECT_TRUE(list().empty()); }

TEST_F(Browsing, SessionsAreListedByName) {
  announce("zoo");
  announce("arena");
  const auto sessions = list();
  ASSERT_EQ(sessions.size(), 2U);
  EXPECT_STREQ(sessions[0].name, "arena");
  EXPECT_STREQ(sessions[1].name, "zoo");
  EXPECT_STREQ(sessions[0].scene, "test");
  EXPECT_STREQ(sessions[0].codec, "quantized");
  EXPECT_STREQ(sessions[0].predictor, "ballistic");
  EXPECT_EQ(sessions[0].capacity, 40U);
  EXPECT_EQ(sessions[0].playable, 1U);
  EXPECT_EQ(sessions[0].frame_rate_hz, 30);
  EXPECT_EQ(sessions[0].participants, 0U);
}

TEST_F(Browsing, StatusFillsInWhoIsThere) {
  announce("zoo");
  transport::ServerStatusMessage status;
  status.session = "zoo";
  status.epoch = 5;
  status.bodies = 39;
  status.participants = 2;
  status.observers = 3;
  status.mbit_per_s = 0.5;
  domain.statuses = {{client::from_server(status), 0}};
  auto sessions = list();
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0].bodies, 39U);
  EXPECT_EQ(sessions[0].participants, 2U);
  EXPECT_EQ(sessions[0].observers, 3U);
  EXPECT_EQ(sessions[0].mbit_per_s, 0.5);
  status.stream = 1;
  domain.statuses = {{client::from_server(status), 0}};
  status.stream = 2;
  status.epoch = 4;
  domain.statuses.push_back({client::from_server(status), 0});
  sessions = list();
  EXPECT_EQ(sessions[0].participants, 4U) << "of all streams of this epoch";
  EXPECT_EQ(sessions[0].observers, 6U);
  EXPECT_EQ(sessions[0].bodies, 39U);
}

TEST_F(Browsing, WhatCannotBePlayedSaysSo) {
  auto other = client::FakeServer(5).session;
  other.protocol_version = 99;
  announce("future", other);
  const auto sessions = list();
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0].playable, 0U);
  EXPECT_EQ(sessions[0].protocol_version, 99U);
  EXPECT_STREQ(sessions[0].codec, "");
}

TEST_F(Browsing, TheWorldsTimeGravityAndOriginAreTold) {
  auto session = client::FakeServer(5).session;
  session.dt_s = 0.02;
  session.gravity = {0, 0, -9};
  session.up_axis = transport::UpAxis::kZ;
  session.continues_epoch = 3;
  session.continues_frame = 400;
  announce("zoo", session);
  const auto sessions = list();
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0].dt_s, 0.02);
  EXPECT_EQ(sessions[0].gravity[2], -9);
  EXPECT_EQ(sessions[0].up_axis, 2U);
  EXPECT_EQ(sessions[0].continues_epoch, 3U);
  EXPECT_EQ(sessions[0].continues_frame, 400U);
}

TEST_F(Browsing, AServerThatStandsByIsNoSession) {
  auto standby = client::FakeServer(5).session;
  standby.server_role = transport::ServerRole::kStandby;
  announce("zoo", standby);
  EXPECT_TRUE(list().empty());
}

TEST_F(Browsing, OfTwoServersOfANameTheFirstIsListed) {
  announce("zoo");
  auto second = client::FakeServer(9).session;
  announce("zoo", second);
  const auto sessions = list();
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0].epoch, 5U);
}

TEST_F(Browsing, AListThatIsTooShortHoldsTheFirst) {
  announce("zoo");
  announce("arena");
  tandem_session_info one = TANDEM_SESSION_INFO_INIT;
  std::size_t count = 0;
  EXPECT_EQ(tandem_browser_list(browser, &one, 1, &count), TANDEM_CAPACITY);
  EXPECT_EQ(count, 2U);
  EXPECT_STREQ(one.name, "arena");
  EXPECT_EQ(tandem_browser_list(browser, nullptr, 0, &count), TANDEM_OK);
  EXPECT_EQ(tandem_browser_list(browser, nullptr, 1, &count), TANDEM_INVALID_ARGUMENT);
  one.size = 1;
  EXPECT_EQ(tandem_browser_list(browser, &one, 1, &count), TANDEM_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace tandem::api
