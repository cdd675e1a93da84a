#include "services/checkpoint/keeper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tandem::checkpoint {
namespace {

constexpr std::int64_t kEndNs = 2'000'000'000;
constexpr Epoch kLastEpoch = Epoch{1}
                             << 53U;  // later ones are no milliseconds; some clients count in doubles

tl::unexpected<Error> refuse(std::string why) { return fail(ErrorCode::kInvalidArgument, std::move(why)); }

std::string told_of(const Checkpoint& checkpoint, const std::string& file) {
  return fmt::format("goes on from {}: frame {} of epoch {}, {} bodies", file, checkpoint.frame,
                     checkpoint.epoch, checkpoint.bodies);
}

}  // namespace

Result<void> check_world(const Checkpoint& checkpoint, const World& world, std::uint32_t capacity) {
  const auto differs = [](const char* what, const std::string& is, const std::string& wanted) {
    return refuse(fmt::format("it is of {} '{}', not '{}'", what, is, wanted));
  };
  if (checkpoint.session != world.session) return differs("session", checkpoint.session, world.session);
  if (checkpoint.scene != world.scene) return differs("scene", checkpoint.scene, world.scene);
  if (checkpoint.engine != world.engine) return differs("engine", checkpoint.engine, world.engine);
  if (checkpoint.capacity() != capacity)
    return refuse(fmt::format("it has {} slots, not {}", checkpoint.capacity(), capacity));
  if (checkpoint.dt_s != world.dt_s)
    return refuse(fmt::format("it is of steps of {} s, not {} s", checkpoint.dt_s, world.dt_s));
  if (checkpoint.types != world.types) return refuse("its types of bodies are others");
  return {};
}

Epoch Start::epoch(Epoch wanted) const { return std::max(wanted, newest_epoch + 1); }

Result<std::unique_ptr<Keeper>> Keeper::open(const Settings& settings, std::int64_t (*clock_ns)()) {
  if (!(settings.interval_s >= kLeastIntervalS && settings.interval_s <= kMostIntervalS))
    return refuse(
        fmt::format("the interval of checkpoints must be {} to {} s", kLeastIntervalS, kMostIntervalS));
  return open_folder(settings.folder).map([&](std::unique_ptr<Disk>&& disk) {
    return std::make_unique<Keeper>(settings, std::move(disk), clock_ns);
  });
}

Keeper::Keeper(const Settings& settings, std::unique_ptr<Disk> disk, std::int64_t (*clock_ns)())
    : settings_(settings), clock_ns_(clock_ns), disk_(std::move(disk)), folder_(*disk_) {}

Result<Start> Keeper::start(const World& world, engine::Simulation& simulation) {
  Start start;
  std::vector<std::byte> state;
  simulation.save(state);
  if (state.empty()) {
    constexpr const char* kWhy = "this simulation cannot be saved (it has no save() and load())";
    if (settings_.required)
      return fail(ErrorCode::kUnsupported, fmt::format("{}, but a checkpoint is required", kWhy));
    start.warnings.push_back(fmt::format("{}: there are no checkpoints", kWhy));
    start.told = "starts afresh";
    return start;
  }
  auto found = folder_.newest([&](const Checkpoint& checkpoint) -> Result<void> {
    if (auto good = check_world(checkpoint, world, simulation.capacity()); !good) return good;
    if (simulation.load(checkpoint.engine_state)) return {};
    return refuse(
        "the engine refuses its part: it is of another scene file, number of bodies, seed or build");
  });
  if (!found) return tl::unexpected(found.error());
  for (const std::string& refused : found->refused) start.warnings.push_back("cannot go on from " + refused);
  if (found->newest_epoch < kLastEpoch) start.newest_epoch = found->newest_epoch;
  if (found->checkpoint) {
    start.newest_epoch = std::max(start.newest_epoch, found->checkpoint->epoch);
    start.told = told_of(*found->checkpoint, fmt::format("{}/{}", disk_->name(), found->file));
    start.goes_on_from = std::make_shared<const Checkpoint>(std::move(*found->checkpoint));
  } else {
    const std::string none = fmt::format("{}: no checkpoint to go on from", disk_->name());
    if (settings_.required) {
      return fail(ErrorCode::kIo,
                  found->refused.empty() ? none : fmt::format("{}; {}", none, found->refused.front()));
    }
    start.told = none + "; starts afresh";
  }
  writer_.emplace(folder_, static_cast<std::int64_t>(settings_.interval_s * 1e9), clock_ns_,
                  std::move(state));
  return start;
}

void Keeper::after_frame(std::int64_t now_ns, const std::function<void(Checkpoint&)>& capture) {
  if (writer_ && writer_->due(now_ns)) writer_->take(now_ns, capture);
}

void Keeper::set_interval(double interval_s) {
  settings_.interval_s = interval_s;
  if (writer_) writer_->set_interval(static_cast<std::int64_t>(interval_s * 1e9));
}

void Keeper::end(std::int64_t now_ns, const std::function<void(Checkpoint&)>& capture) {
  if (!writer_ || !writer_->finish(kEndNs)) return;
  writer_->take(now_ns, capture);
  writer_->finish(kEndNs);
}

std::vector<std::string> Keeper::take_notices(std::int64_t now_ns) {
  return writer_ ? writer_->take_notices(now_ns) : std::vector<std::string>();
}

Figures Keeper::figures(std::int64_t now_ns) const { return writer_ ? writer_->figures(now_ns) : Figures(); }

}  // namespace tandem::checkpoint
