// A server of a simulation of its own, ten bodies that fall and bounce, from an installed Tandem alone:
// session "ten_bodies" on DDS domain 0, for as many seconds as the first argument says.

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <vector>

#include "sdk/transport/clock.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "services/host/host.hpp"
#include "services/host/publisher.hpp"

namespace {

using namespace tandem;

constexpr std::uint32_t kBodies = 10;

class TenBodies final : public engine::Simulation {
 public:
  TenBodies() {
    for (std::uint32_t i = 0; i < kBodies; ++i) position_[1][i] = 1 + 0.1F * static_cast<float>(i);
  }
  std::uint32_t capacity() const override { return kBodies; }
  double dt_s() const override { return 1.0 / 30; }
  engine::Vec3 gravity() const override { return {0, -9.81, 0}; }
  double damping_per_s() const override { return 0; }
  engine::Classification classify(const engine::Input&) const override { return {}; }  // takes none
  void apply(const engine::Input&) override {}
  void step() override {
    const auto dt = static_cast<float>(dt_s());
    for (std::uint32_t i = 0; i < kBodies; ++i) {
      velocity_[1][i] += static_cast<float>(gravity()[1]) * dt;
      position_[1][i] += velocity_[1][i] * dt;
      if (position_[1][i] < 0 && velocity_[1][i] < 0) velocity_[1][i] = -velocity_[1][i];
    }
  }
  engine::Bodies bodies() const override {
    return {{position_[0], position_[1], position_[2]},
            {velocity_[0], velocity_[1], velocity_[2]},
            alive_,
            type_};
  }
  std::span<const engine::Event> events() const override { return {}; }
  std::uint32_t colliding() const override { return 0; }
  void save(std::vector<std::byte>&) const override {}
  bool load(std::span<const std::byte>) override { return false; }

 private:
  using Column = std::vector<float>;
  std::array<Column, 3> position_{Column(kBodies), Column(kBodies), Column(kBodies)};
  std::array<Column, 3> velocity_{Column(kBodies), Column(kBodies), Column(kBodies)};
  std::vector<std::uint8_t> alive_ = std::vector<std::uint8_t>(kBodies, 1);
  std::vector<std::uint16_t> type_ = std::vector<std::uint16_t>(kBodies, 0);
};

Result<std::uint64_t> serve(std::int64_t lasts_ns) {
  constexpr double kThreshold = 0.01, kExtent = 10;  // scene units
  TenBodies simulation;
  host::HostConfig config;
  config.session = "ten_bodies";
  config.epoch = static_cast<Epoch>(transport::wall_ns() / kMillisecond);
  const auto lattice = host::choose_lattice(kThreshold, kExtent, simulation.dt_s());
  if (!lattice) return tl::unexpected(lattice.error());
  const auto parameters = host::codec_parameters(*lattice, kThreshold, 0, 0);
  if (!parameters) return tl::unexpected(parameters.error());
  config.stream.lattice = *lattice;
  config.stream.layout.capacity = kBodies;
  config.stream.layout.parameters.codec = *parameters;

  transport::DdsOptions dds;
  dds.session = config.session;
  auto port = transport::make_dds_server_port(dds);
  if (!port) return tl::unexpected(port.error());
  auto host = host::Host::create(config, simulation, **port);
  if (!host) return tl::unexpected(host.error());
  host::Publisher publisher((*host)->outbox(), **port);
  const std::int64_t end_ns = transport::steady_ns() + lasts_ns;
  while (transport::steady_ns() < end_ns && (*host)->state() != host::Host::State::kRefused) {
    (*host)->poll(transport::steady_ns(), transport::wall_ns());
    const std::int64_t wait_ns = (*host)->next_wake_ns() - transport::steady_ns();
    if (wait_ns > 0) (*port)->wait(std::chrono::nanoseconds(wait_ns));
  }
  return (*host)->totals().frames;
}

}  // namespace

int main(int argc, char** argv) {
  const auto frames = serve((argc > 1 ? std::atoi(argv[1]) : 10) * kSecond);
  if (!frames) return std::fprintf(stderr, "%s\n", frames.error().message.c_str()), 1;
  std::printf("%llu frames\n", static_cast<unsigned long long>(*frames));
  return *frames == 0 ? 1 : 0;
}
