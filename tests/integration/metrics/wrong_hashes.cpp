// A server with a fault in its memory: from a frame on it announces the hash of another state. Ends at
// SIGTERM.
//
// wrong_hashes SCENE FRAME

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/clock.hpp"
#include "services/engines/scenes/scene.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/host/host.hpp"

namespace {

std::atomic<bool> stop{false};

template <class R>
auto must(R result) {
  if (result) return std::move(*result);
  std::fprintf(stderr, "%s\n", result.error().message.c_str());
  std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace tandem;
  if (argc != 3) return 2;
  static_assert(std::atomic<bool>::is_always_lock_free);
  std::signal(SIGTERM, [](int) { stop = true; });
  alarm(300);
  constexpr std::uint32_t kBodies = 200;
  const Frame from = std::strtoull(argv[2], nullptr, 10);
  const scenes::Scene scene = must(scenes::load_scene(argv[1]));
  sessions::SessionChoice choice;
  choice.bodies = kBodies;
  choice.predictor = "ballistic";
  auto config = must(sessions::plan_session(scene, choice));
  config.epoch = static_cast<Epoch>(transport::wall_ns() / 1'000'000);
  const auto simulation = must(scenes::make_simulation(scene, kBodies, 1, 1));
  const auto port = must(transport::make_dds_server_port({}));
  const auto host = must(host::Host::create(std::move(config), *simulation, *port));
  while (!stop && !host->error()) {
    host->poll(transport::steady_ns(), transport::wall_ns());
    while (auto message = host->outbox().pop(std::chrono::nanoseconds(0))) {
      auto* const delta = std::get_if<transport::DeltaMessage>(&*message);
      if (delta != nullptr && delta->frame >= from) delta->hash ^= 1;
      static_cast<void>(host::publish(*port, *message));
    }
    const std::int64_t wait_ns = host->next_wake_ns() - transport::steady_ns();
    if (wait_ns > 0) port->wait(std::chrono::nanoseconds(wait_ns));
  }
  return 0;
}
