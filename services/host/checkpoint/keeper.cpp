#include "services/host/checkpoint/keeper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::checkpoint {
namespace {

constexpr std::int64_t kEndNs = 2'000'000'000;
constexpr Epoch kEpochsAhead = 1'000'000;  // where a clock went back; in ms a quarter of an hour

tl::unexpected<Error> refuse(std::string why) { return fail(ErrorCode::kInvalidArgument, std::move(why)); }

/// What the simulation would act on without a further look.
Result<void> check_inputs(const Checkpoint& checkpoint, const engine::Simulation& simulation) {
  using Effect = engine::Classification::Effect;
  const auto check = [&simulation](const engine::Input& input, Effect effect) -> Result<void> {
    if (simulation.classify(input).effect == effect) return {};
    return refuse(fmt::format("the engine refuses an input of kind {} that waits in it", input.kind));
  };
  for (const Scheduled& waiting : checkpoint.scheduled)
    if (auto good = check(waiting.input, Effect::kScheduled); !good) return good;
  for (const engine::Input& input : checkpoint.immediate)
    if (auto good = check(input, Effect::kImmediate); !good) return good;
  return {};
}

std::string told_of(const Checkpoint& checkpoint, const std::string& file) {
  return fmt::format("goes on from {}: frame {} of epoch {}, {} bodies", file, checkpoint.frame,
                     checkpoint.epoch, checkpoint.bodies);
}

}  // namespace

Result<void> check_world(const Checkpoint& checkpoint, const CheckpointWorld& world, std::uint32_t capacity) {
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

Result<void> load_world(const Checkpoint& checkpoint, const CheckpointWorld& world,
                        engine::Simulation& simulation) {
  if (auto good = check_world(checkpoint, world, simulation.capacity()); !good) return good;
  std::vector<std::byte> before;
  const bool has_inputs = !checkpoint.scheduled.empty() || !checkpoint.immediate.empty();
  if (has_inputs) simulation.save(before);
  if (!simulation.load(checkpoint.engine_state))
    return refuse(
        "the engine refuses its part: it is of another scene file, number of bodies, seed or build");
  auto good = check_inputs(checkpoint, simulation);
  if (!good) static_cast<void>(simulation.load(before));
  return good;
}

// A server may announce an epoch and end before it has written a checkpoint of it.
Epoch Start::epoch(Epoch wanted) const {
  if (wanted > newest_epoch) return wanted;
  return begun_by(wanted % kBeginners, newest_epoch + kBeginners + wanted % kEpochsAhead);
}

Result<std::unique_ptr<Keeper>> Keeper::open(const Settings& settings, std::int64_t (*clock_ns)()) {
  if (!(settings.interval_s >= kLeastIntervalS && settings.interval_s <= kMaxIntervalS))
    return refuse(
        fmt::format("the interval of checkpoints must be {} to {} s", kLeastIntervalS, kMaxIntervalS));
  if (settings.folder.empty()) return std::make_unique<Keeper>(settings, nullptr, clock_ns);
  return open_folder(settings.folder).map([&](std::unique_ptr<Disk>&& disk) {
    return std::make_unique<Keeper>(settings, std::move(disk), clock_ns);
  });
}

Keeper::Keeper(const Settings& settings, std::unique_ptr<Disk> disk, std::int64_t (*clock_ns)(),
               WritesIn writes_in)
    : settings_(settings), clock_ns_(clock_ns), writes_in_(writes_in), disk_(std::move(disk)) {
  if (disk_) folder_.emplace(*disk_);
}

Result<Start> Keeper::start(const CheckpointWorld& world, engine::Simulation& simulation) {
  Start start;
  std::vector<std::byte> state;
  simulation.save(state);
  if (state.empty()) {
    constexpr const char* kWhy = "this simulation cannot be saved (it has no save() and load())";
    if (settings_.required)
      return fail(ErrorCode::kUnsupported, fmt::format("{}, but a checkpoint is required", kWhy));
    if (disk_) start.warnings.push_back(fmt::format("{}: there are no checkpoints", kWhy));
    start.told = "starts afresh";
    return start;
  }
  can_save_ = true;
  if (!disk_) return start;
  auto found = folder_->newest(
      [&](const Checkpoint& checkpoint) { return load_world(checkpoint, world, simulation); });
  if (!found) return tl::unexpected(found.error());
  for (const std::string& refused : found->refused) start.warnings.push_back("cannot go on from " + refused);
  start.newest_epoch = found->newest_epoch;
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
  make_writer(std::move(state));
  return start;
}

Result<Epoch> Keeper::take_over(const CheckpointWorld& world, engine::Simulation& simulation) {
  std::vector<std::byte> state;
  simulation.save(state);
  can_save_ = !state.empty();
  if (!disk_) return Epoch{0};
  // None is needed; but those of this world are removed when newer ones are there.
  const auto found = folder_->newest(
      [&](const Checkpoint& checkpoint) { return load_world(checkpoint, world, simulation); });
  if (!found) return tl::unexpected(found.error());
  if (found->checkpoint && !simulation.load(state))
    return fail(ErrorCode::kIo, "the simulation does not load what it has just saved");
  make_writer(std::move(state));
  return found->newest_epoch;
}

void Keeper::make_writer(std::vector<std::byte> memory) {
  writer_.emplace(folder_ ? &*folder_ : nullptr, static_cast<std::int64_t>(settings_.interval_s * 1e9),
                  clock_ns_, std::move(memory), writes_in_);
}

void Keeper::serve_standbys(bool any) {
  if (any && !writer_ && can_save_) make_writer({});
  if (writer_) writer_->keep_latest(any);
  if (!any && !folder_) writer_.reset();
}

void Keeper::after_frame(std::int64_t now_ns, bool at_once, const std::function<void(Checkpoint&)>& capture) {
  if (takes_frame(now_ns, at_once)) writer_->take(now_ns, capture);
}

bool Keeper::takes_frame(std::int64_t now_ns, bool at_once) {
  return writer_ && (writer_->due(now_ns) || (at_once && writer_->idle()));
}

std::shared_ptr<const Encoded> Keeper::latest() const { return writer_ ? writer_->latest() : nullptr; }

void Keeper::set_interval(double interval_s) {
  TANDEM_ASSERT(interval_s >= kLeastIntervalS && interval_s <= kMaxIntervalS);
  settings_.interval_s = interval_s;
  if (writer_) writer_->set_interval(static_cast<std::int64_t>(interval_s * 1e9));
}

void Keeper::end(std::int64_t now_ns, const std::function<void(Checkpoint&)>& capture) {
  if (!folder_ || !writer_ || !writer_->finish(kEndNs)) return;
  writer_->take(now_ns, capture);
  writer_->finish(kEndNs);
}

void Keeper::write_now() {
  if (writer_) writer_->write_now();
}

std::vector<std::string> Keeper::take_notices(std::int64_t now_ns) {
  return writer_ ? writer_->take_notices(now_ns) : std::vector<std::string>();
}

std::optional<Figures> Keeper::figures(std::int64_t now_ns) const {
  if (!folder_) return std::nullopt;
  Figures figures = writer_ ? writer_->figures(now_ns) : Figures();
  figures.interval_s = settings_.interval_s;
  return figures;
}

}  // namespace tandem::checkpoint
