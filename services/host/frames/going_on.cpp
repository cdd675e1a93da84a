#include "services/host/frames/going_on.hpp"

#include <algorithm>
#include <utility>

namespace tandem::host {

checkpoint::CheckpointWorld checkpoint_world(const HostConfig& config) {
  checkpoint::CheckpointWorld world{.session = config.session,
                                    .scene = config.scene,
                                    .engine = config.engine,
                                    .dt_s = config.streams.front().lattice.dt_s,
                                    .types = {}};
  for (const transport::BodyType& type : config.types) world.types.push_back(type.name);
  return world;
}

void begin_from(const checkpoint::Start& start, HostConfig& config) {
  config.epoch = start.epoch(checkpoint::begun_by(0, config.epoch));
  config.goes_on_from = start.goes_on_from;
}

void begin_takeover(checkpoint::Start start, const transport::ParticipantId& from, HostConfig& config) {
  start.newest_epoch = std::max(start.newest_epoch, start.goes_on_from->epoch);
  config.epoch = start.epoch(config.epoch);
  config.goes_on_from = std::move(start.goes_on_from);
  config.takes_over_from = from;
  config.claim_ns = 0;
}

}  // namespace tandem::host
