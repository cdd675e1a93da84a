// Data of bodies of tandem::Server, and clients of tandem::Client that read them, over DDS.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "tandem/client.hpp"
#include "tandem/host.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kRowBodies = 1000;

/// Bodies that stand still in a row, with records of `record_bytes`.
class Row final : public engine::Simulation {
 public:
  explicit Row(std::size_t record_bytes) : data(kRowBodies * record_bytes) {
    for (std::uint32_t i = 0; i < kRowBodies; ++i) x_[i] = 0.01F * static_cast<float>(i);
  }
  [[nodiscard]] std::uint32_t capacity() const override { return kRowBodies; }
  [[nodiscard]] double dt_s() const override { return 0.01; }
  [[nodiscard]] engine::Vec3 gravity() const override { return {}; }
  void step() override {}
  void save(std::vector<std::byte>& out) const override { out = data; }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override {
    data.assign(bytes.begin(), bytes.end());
    return true;
  }
  [[nodiscard]] engine::Bodies bodies() const override {
    engine::Bodies bodies{
        .position = {x_, zero_, zero_}, .velocity = {zero_, zero_, zero_}, .alive = alive_, .type = type_};
    bodies.data = data;
    return bodies;
  }
  template <class T>
  void set(std::uint32_t slot, std::size_t record_bytes, std::size_t offset, T value) {
    std::memcpy(&data[slot * record_bytes + offset], &value, sizeof value);
  }
  std::vector<std::byte> data;

 private:
  std::vector<float> x_ = std::vector<float>(kRowBodies), zero_ = x_;
  std::vector<std::uint8_t> alive_ = std::vector<std::uint8_t>(kRowBodies, 1);
  std::vector<std::uint16_t> type_ = std::vector<std::uint16_t>(kRowBodies);
};

class DataOverDds : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    ::setenv("CYCLONEDDS_URI",
             "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\" "
             "multicast=\"true\"/></Interfaces></General><Discovery><Tag>data-test</Tag></Discovery>"
             "</Domain></CycloneDDS>",
             1);
  }
  [[nodiscard]] static Client join(const std::string& stream = "auto") {
    auto client = Client::connect({.session = "data", .domain = 74, .prefer = stream});
    if (!client) throw std::runtime_error(client.error().message);
    return std::move(*client);
  }
  static bool plays(const Client& client) {
    const auto status = client.status();
    return status && status->phase == ClientPhase::kPlaying;
  }
  template <class Done>
  static bool poll_until(Server& server, const Done& done) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{30};
    while (!done() && std::chrono::steady_clock::now() < end)
      if (!server.poll(0.01)) return false;
    return done();
  }

  ServerOptions options{.session = "data", .domain = 74, .data = "u8 health, f32 heat, rgba colour"};
};

TEST_F(DataOverDds, ClientsHaveTheServersValues) {
  Row simulation(9);
  simulation.set<std::uint8_t>(7, 9, 0, 99);
  auto server = Server::start(options, simulation);
  ASSERT_TRUE(server) << server.error().message;
  Client client = join();
  ASSERT_TRUE(poll_until(*server, [&] { return plays(client); }));
  const auto fields = client.data_fields();
  ASSERT_EQ(fields.size(), 3U);
  EXPECT_EQ(std::string(fields[1].name), "heat");
  EXPECT_EQ(fields[1].kind, TANDEM_DATA_F32);
  EXPECT_EQ(fields[2].offset, 5U);
  ASSERT_EQ(client.data<std::uint8_t>("health").size(), kRowBodies);
  EXPECT_EQ(client.data<std::uint8_t>("health")[7], 99);
  EXPECT_TRUE(client.data<std::uint8_t>("heat").empty());   // of another size
  EXPECT_TRUE(client.data<std::uint8_t>("speed").empty());  // no such field

  simulation.set(3, 9, 1, -36.6F);
  for (std::uint32_t slot = 0; slot < kRowBodies; ++slot)
    simulation.set<std::uint32_t>(slot, 9, 5, slot * 2654435761U);
  ASSERT_TRUE(poll_until(*server, [&] { return client.data<float>("heat")[3] == -36.6F; }));
  const auto colours = client.data<std::uint32_t>("colour");
  for (std::uint32_t slot = 0; slot < kRowBodies; ++slot) ASSERT_EQ(colours[slot], slot * 2654435761U);
  EXPECT_EQ(client.status()->hash_mismatches, 0U);
}

TEST_F(DataOverDds, ALoopHandsThemOverWithItsColumns) {
  options.data = "u16 score";
  HandedColumns columns({.capacity = 3, .dt_s = 0.01, .data_bytes = 2});
  std::ranges::fill(columns.alive(), std::uint8_t{1});
  ASSERT_EQ(columns.data().size(), 6U);
  columns.data()[2] = std::byte{7};
  auto server = Server::start(options, columns);
  ASSERT_TRUE(server) << server.error().message;
  Client client = join();
  const auto told = [&](std::vector<std::uint16_t> scores) {
    return poll_until(*server, [&] {
      if (columns.wanted()) columns.hand_over();
      return plays(client) && client.data<std::uint16_t>("score") == scores;
    });
  };
  ASSERT_TRUE(told({0, 7, 0}));
  columns.data()[5] = std::byte{1};
  ASSERT_TRUE(told({0, 7, 256}));
}

TEST_F(DataOverDds, AServerThatGoesOnFromACheckpointHasThoseOfItsSimulation) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "tandem-data-test";
  std::filesystem::remove_all(folder);
  options.data = "u32 number";
  options.checkpoint_dir = folder;
  options.checkpoint_interval_s = 0.05;
  Client client = join();
  const auto told = [&](Server& server, std::uint32_t number) {
    return poll_until(server, [&] {
      const auto numbers = client.data<std::uint32_t>("number");
      return plays(client) && numbers.size() == kRowBodies && numbers[9] == number;
    });
  };
  {
    Row simulation(4);
    simulation.set<std::uint32_t>(9, 4, 0, 41);
    auto server = Server::start(options, simulation);
    ASSERT_TRUE(server) << server.error().message;
    ASSERT_TRUE(told(*server, 41));
    simulation.set<std::uint32_t>(9, 4, 0, 42);
    ASSERT_TRUE(told(*server, 42));
    const std::uint64_t before = server->status().checkpoints;
    ASSERT_TRUE(poll_until(*server, [&] { return server->status().checkpoints > before + 1; }));
  }
  Row simulation(4);
  auto server = Server::start(options, simulation);
  ASSERT_TRUE(server) << server.error().message;
  EXPECT_GT(server->status().continues_frame, 0U);
  ASSERT_TRUE(poll_until(*server, [&] { return client.status()->phase == ClientPhase::kPlaying; }));
  EXPECT_TRUE(told(*server, 42));
  EXPECT_EQ(client.status()->hash_mismatches, 0U);
  std::filesystem::remove_all(folder);
}

TEST_F(DataOverDds, AStreamMayLeaveThemOutOrLimitTheirRate) {
  options.data = "rgba colour";
  options.streams = {"all:ballistic", "slow:ballistic,data_kbit_s=20", "none:ballistic,data=no"};
  Row simulation(4);
  auto server = Server::start(options, simulation);
  ASSERT_TRUE(server) << server.error().message;
  Client all = join("all"), slow = join("slow"), none = join("none");
  ASSERT_TRUE(poll_until(*server, [&] { return plays(all) && plays(slow) && plays(none); }));
  for (std::uint32_t slot = 0; slot < kRowBodies; ++slot)
    simulation.set<std::uint32_t>(slot, 4, 0, slot * 2654435761U);
  const auto is_there = [](const Client& client) { return client.data<std::uint32_t>("colour").back() != 0; };
  ASSERT_TRUE(poll_until(*server, [&] { return is_there(all); }));
  EXPECT_FALSE(is_there(slow));  // 32 kbit take 1.6 s
  ASSERT_TRUE(poll_until(*server, [&] { return is_there(slow); }));
  EXPECT_EQ(slow.data<std::uint32_t>("colour"), all.data<std::uint32_t>("colour"));
  EXPECT_TRUE(none.data<std::uint32_t>("colour").empty());
  for (const Client* client : {&all, &slow, &none}) EXPECT_EQ(client->status()->hash_mismatches, 0U);
}

TEST_F(DataOverDds, WhatCannotBeServedIsRefusedByName) {
  Row simulation(9);
  const auto refusal = [&](const std::string& data) {
    options.data = data;
    const auto server = Server::start(options, simulation);
    return server ? std::string("accepted") : server.error().message;
  };
  EXPECT_NE(refusal("u8 a, u8 a").find("'a' is there twice"), std::string::npos);
  EXPECT_NE(refusal("u64 a").find("'u64 a'"), std::string::npos);
  EXPECT_NE(refusal("u32 a, u32 b").find("9000 bytes of data, not 8000"), std::string::npos);
  options.streams = {"x:ballistic,data=maybe"};
  EXPECT_NE(refusal("u8 health, f32 heat, rgba colour").find("data must be yes or no"), std::string::npos);
}

}  // namespace
}  // namespace tandem
