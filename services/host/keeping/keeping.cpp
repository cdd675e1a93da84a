#include "services/host/keeping/keeping.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "services/host/frames/going_on.hpp"

namespace tandem::host {

Keeping::Keeping(std::unique_ptr<checkpoint::Keeper> keeper, Log log, std::int64_t (*clock_ns)())
    : keeper_(std::move(keeper)), log_(std::move(log)), clock_ns_(clock_ns) {
  TANDEM_ASSERT(keeper_ != nullptr && log_ != nullptr && clock_ns_ != nullptr);
}

Result<Keeping> Keeping::stand_by(const checkpoint::Settings& settings, Log log, std::int64_t (*clock_ns)()) {
  return checkpoint::Keeper::open(settings, clock_ns).map([&](std::unique_ptr<checkpoint::Keeper>&& keeper) {
    return Keeping(std::move(keeper), std::move(log), clock_ns);
  });
}

Result<Keeping> Keeping::begin(const checkpoint::Settings& settings, engine::Simulation& simulation,
                               HostConfig& config, Log log, std::int64_t (*clock_ns)()) {
  auto keeping = stand_by(settings, std::move(log), clock_ns);
  if (!keeping) return keeping;
  const auto start = keeping->keeper_->start(checkpoint_world(config), simulation);
  if (!start) return tl::unexpected(start.error());
  for (const std::string& warning : start->warnings) keeping->log_("checkpoint: " + warning, true);
  if (!settings.folder.empty()) keeping->log_("checkpoint: " + start->told, false);
  begin_from(*start, config);
  return keeping;
}

Result<void> Keeping::take_over(std::shared_ptr<const checkpoint::Checkpoint> world,
                                const transport::ParticipantId& from, Epoch epoch,
                                engine::Simulation& simulation, HostConfig& config) {
  TANDEM_ASSERT(world != nullptr && !ran_);
  const auto newest = keeper_->take_over(checkpoint_world(config), simulation);
  if (!newest) return tl::unexpected(newest.error());
  checkpoint::Start start;
  start.newest_epoch = *newest;
  start.goes_on_from = std::move(world);
  config.epoch = epoch;
  begin_takeover(start, from, config);
  return {};
}

void Keeping::after_poll(Host& host, bool produced, std::int64_t now_ns) {
  if (std::exchange(serves_, host.wants_checkpoints()) != serves_) keeper_->serve_standbys(serves_);
  if (produced) {
    ran_ = true;
    const bool at_once = host.wants_checkpoint_now();
    if (!host.frame_under_way()) {
      keeper_->after_frame(now_ns, at_once, [&host](checkpoint::Checkpoint& out) { host.capture(out); });
    } else if (keeper_->takes_frame(now_ns, at_once)) {
      host.rest_after_frame();
    }
  }
  if (serves_) {
    auto latest = keeper_->latest();
    if (latest && latest->moment.epoch == host.session().epoch) host.offer_checkpoint(latest);
  }
  tell(now_ns);
}

void Keeping::end(const Host& host) {
  const Host::State state = host.state();
  if (!ran_ || state == Host::State::kRefused || state == Host::State::kHandedOver) return;
  // A simulation that failed may have nothing to save any more.
  if (host.frame_under_way() || (state == Host::State::kEnded && host.error())) return;
  keeper_->end(clock_ns_(), [&host](checkpoint::Checkpoint& out) { host.capture(out); });
  tell(clock_ns_());
}

void Keeping::tell(std::int64_t now_ns) {
  for (const std::string& line : keeper_->take_notices(now_ns)) log_("checkpoint: " + line, true);
}

}  // namespace tandem::host
