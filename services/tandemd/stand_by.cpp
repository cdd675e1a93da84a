#include "services/tandemd/stand_by.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <memory>
#include <span>
#include <utility>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/client_id.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/checkpoint/keeper.hpp"
#include "services/host/frames/going_on.hpp"
#include "services/host/frames/roll_forward.hpp"
#include "services/host/standby/standby.hpp"

namespace tandem::daemon {
namespace {

using transport::steady_ns;

void log_notices(standby::Standby& standby) {
  for (const standby::Standby::Notice& notice : standby.take_notices())
    spdlog::log(notice.warning ? spdlog::level::warn : spdlog::level::info, "standby: {}", notice.text);
}

}  // namespace

Result<bool> stand_by(DaemonOptions& options, engine::Simulation& simulation, transport::ServerPort& port,
                      host::HostConfig& config, host::Keeping& keeping, Service& service, Metrics& metrics,
                      const std::atomic<bool>& stop) {
  const checkpoint::CheckpointWorld world = host::checkpoint_world(config);
  const auto accept = [&](const checkpoint::Checkpoint& checkpoint,
                          const transport::SessionMessage& live) -> Result<void> {
    if (live.frame_rate_hz != config.frame_rate_hz)
      return fail(ErrorCode::kInvalidArgument, fmt::format("it is of {} frames a second, not {}",
                                                           live.frame_rate_hz, config.frame_rate_hz));
    return load_world(checkpoint, world, simulation);
  };
  const auto follows = [&](const checkpoint::Checkpoint& from,
                           std::span<const transport::JournalMessage> journal) {
    return simulation.load(from.engine_state) && host::roll_forward(config, simulation, from, journal);
  };
  // Clients find the writers before they are needed.
  if (auto opened = port.open_streams(static_cast<std::uint32_t>(config.streams.size())); !opened)
    return tl::unexpected(opened.error());
  auto standby = standby::Standby::create({.session = options.session,
                                           .id = transport::random_client_id(),
                                           .rank = options.standby_rank,
                                           .epoch = config.epoch},
                                          port, accept, follows);
  if (!standby) return tl::unexpected(standby.error());
  spdlog::info("standby: waits for the live server of session '{}' on domain {}", options.session,
               options.domain);
  while (!(*standby)->poll(steady_ns())) {
    if (stop.load(std::memory_order_relaxed)) return false;
    if (std::string line; transport::dds_server_network(&line) == transport::NetworkState::kMoved)
      return fail(ErrorCode::kTransport, std::move(line));
    if (std::string why = simulation.failure(); !why.empty()) return fail(ErrorCode::kIo, std::move(why));
    log_notices(**standby);
    service.watch(**standby, options.session, steady_ns());
    service.reload(options, config, keeping, steady_ns());
    metrics.watch(**standby, steady_ns());
    const std::int64_t wait_ns = (*standby)->next_wake_ns() - steady_ns();
    if (wait_ns > 0) port.wait(std::chrono::nanoseconds(wait_ns));
  }
  log_notices(**standby);
  const std::int64_t began_ns = steady_ns();
  const standby::Takeover takeover = (*standby)->take_over();
  auto continued = host::continue_world(config, simulation, *takeover.checkpoint, takeover.journal);
  if (!continued) return tl::unexpected(continued.error());
  if (!continued->why_not.empty())
    spdlog::warn("standby: {}; goes on from the checkpoint, and what came after it is lost",
                 continued->why_not);
  const Frame frame = continued->world.frame;
  auto taken = keeping.take_over(std::make_shared<const checkpoint::Checkpoint>(std::move(continued->world)),
                                 takeover.from, (*standby)->epoch_at(transport::wall_ns() / kMillisecond),
                                 simulation, config);
  if (!taken) return tl::unexpected(taken.error());
  spdlog::info(
      "standby: takes over from epoch {} at frame {}, {} frames after its checkpoint, {} behind the live server, "
      "after {:.0f} ms{}",
      takeover.checkpoint->epoch, frame, frame - takeover.checkpoint->frame,
      takeover.published > frame ? takeover.published - frame : 0,
      static_cast<double>(steady_ns() - began_ns) * 1e-6, takeover.handed_over ? " (handed over)" : "");
  return true;
}

}  // namespace tandem::daemon
