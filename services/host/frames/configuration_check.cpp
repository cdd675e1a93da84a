#include "services/host/frames/configuration_check.hpp"

#include <fmt/format.h>

#include <utility>

#include "sdk/wire/port.hpp"
#include "services/host/frames/scene_check.hpp"

namespace tandem::host {
namespace {

tl::unexpected<Error> refuse(std::string message) {
  return fail(ErrorCode::kInvalidArgument, std::move(message));
}

}  // namespace

Result<void> check(const ServiceConfig& config) {
  if (auto named = transport::check_session_name(config.session); !named) return named;
  if (!(config.frame_rate_hz >= 1 && config.frame_rate_hz <= 1000))
    return refuse("frame rate must lie in 1..1000 Hz");
  if (config.window_ceiling < 1 || config.window_ceiling > 64)
    return refuse("window ceiling must lie in 1..64");
  if (config.window && (*config.window < 1 || *config.window > config.window_ceiling)) {
    return refuse(fmt::format("window must lie in 1..{}", config.window_ceiling));
  }
  if (config.client_limit == 0 || config.participant_limit == 0)
    return refuse("client limits must be positive");
  if (config.epoch == 0) return refuse("epoch must not be 0");
  return {};
}

Result<void> check(const HostConfig& config, const engine::Simulation& simulation) {
  if (auto good = check(config); !good) return good;
  if (auto good = check_stream_names(config.streams); !good) return good;
  if (config.streams.front().offered != Offered::kAlways)
    return refuse("the first stream of a session is always offered");
  const Layout& layout = config.streams.front().layout;
  for (std::size_t i = encoding_offers(config.streams); i < config.streams.size(); ++i)
    if (encoding_offer(config.streams, i) == i)
      return refuse("offers that encode stand before those that carry their frames");
  for (const StreamConfig& stream : config.streams) {
    if (stream.layout.lead > 1) return refuse("lead must be 0 or 1");
    if (stream.layout.world != layout.world) return refuse("all streams of a session have the same features");
    const auto other = std::ranges::find_if(
        config.streams, [&](const StreamConfig& each) { return !each.layout.data.empty(); });
    if (!stream.layout.data.empty() && stream.layout.data != other->layout.data)
      return refuse("all streams of a session have the same data of bodies, or none");
    if (stream.layout.lead != layout.lead) return refuse("all streams of a session must have the same lead");
  }
  if (config.types.size() != layout.type_count)
    return refuse(fmt::format("the layout has {} body types, but {} are described", layout.type_count,
                              config.types.size()));
  static_assert(engine::kMaxBodies == kMaxCapacity);
  const std::uint32_t capacity = simulation.capacity();
  if (capacity != layout.capacity)
    return refuse(
        fmt::format("the layout has {} slots, but the simulation has {}", layout.capacity, capacity));
  // Reads it as clients do; otherwise each of them would fail.
  if (const std::string wrong = wrong_with_scene(config.scene_json); !wrong.empty())
    return refuse("scene_json: " + wrong);
  return {};
}

}  // namespace tandem::host
