#include "tests/bench/lab/memory.hpp"

#include <utility>

#include "sdk/client/client_core.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "services/host/host.hpp"
#include "tests/bench/lab/scale/machine.hpp"

namespace tandem::lab {
namespace {

constexpr std::int64_t kStepNs = 1'000'000;
constexpr std::int64_t kWallAheadNs = 1'700'000'000'000'000'000;

/// Destroys an object and returns how many bytes the heap got back.
template <class T>
std::int64_t returned_by(std::unique_ptr<T>& object) {
  const std::int64_t before = heap_bytes();
  object.reset();
  return before - heap_bytes();
}

}  // namespace

Result<MemoryUse> measure_memory(const std::function<Result<HostedSimulation>()>& make,
                                 std::uint64_t frames) {
  auto hosted = make();
  if (!hosted) return tl::unexpected(hosted.error());
  transport::simulated::Network network({});
  auto server_port = network.make_server(hosted->config.session);
  if (!server_port) return tl::unexpected(server_port.error());
  auto client_port = network.make_client(hosted->config.session);
  if (!client_port) return tl::unexpected(client_port.error());
  auto created = host::Host::create(std::move(hosted->config), *hosted->simulation, **server_port);
  if (!created) return tl::unexpected(created.error());
  std::unique_ptr<host::Host> host = std::move(*created);
  client::CoreOptions options;
  options.session = host->session().session;
  options.id = 1;
  auto client = std::make_unique<client::ClientCore>(options, **client_port);
  client->start_sampling();

  auto sample = std::make_unique<Sample>();
  const std::int64_t limit_ns = 10'000'000'000 + static_cast<std::int64_t>(static_cast<double>(frames) * 4e9 *
                                                                           hosted->simulation->dt_s());
  while (client->statistics().frames_applied < frames) {
    const std::int64_t now_ns = network.now_ns() + kStepNs;
    if (now_ns > limit_ns) return fail(ErrorCode::kTimeout, "the client did not play as long as it should");
    network.advance_to(now_ns);
    const bool produced = host->poll(now_ns, now_ns + kWallAheadNs);
    if (auto drained = host::drain(host->outbox(), **server_port); !drained)
      return tl::unexpected(drained.error());
    static_cast<void>(host->take_notices());
    client->poll({now_ns, now_ns + kWallAheadNs});
    if (produced) client->sample(*sample, SampleMode::kExtrapolate, {now_ns, now_ns + kWallAheadNs});
  }
  MemoryUse use;
  use.client_bytes = returned_by(client) + returned_by(sample);
  use.server_bytes = returned_by(host);
  use.engine_bytes = returned_by(hosted->simulation);
  return use;
}

}  // namespace tandem::lab
