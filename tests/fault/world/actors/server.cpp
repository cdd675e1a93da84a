#include "tests/fault/world/actors/server.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "services/host/checkpoint/format.hpp"
#include "services/host/frames/going_on.hpp"
#include "services/host/frames/roll_forward.hpp"
#include "tests/fault/world/actors/door_engine.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem::world {
namespace {

/// The disk of a machine outlives the processes on it.
class Mounted final : public checkpoint::Disk {
 public:
  explicit Mounted(std::shared_ptr<checkpoint::SimulatedDisk> disk) : disk_(std::move(disk)) {}
  [[nodiscard]] const std::string& name() const override { return disk_->name(); }
  [[nodiscard]] Result<std::vector<std::string>> list() override { return disk_->list(); }
  [[nodiscard]] Result<std::vector<std::byte>> read(const std::string& file,
                                                    std::uint64_t most_bytes) override {
    return disk_->read(file, most_bytes);
  }
  [[nodiscard]] Result<void> write(const std::string& file, std::span<const std::byte> bytes) override {
    return disk_->write(file, bytes);
  }
  [[nodiscard]] Result<void> sync(const std::string& file) override { return disk_->sync(file); }
  [[nodiscard]] Result<void> rename(const std::string& from, const std::string& to) override {
    return disk_->rename(from, to);
  }
  [[nodiscard]] Result<void> remove(const std::string& file) override { return disk_->remove(file); }
  [[nodiscard]] Result<void> sync_folder() override { return disk_->sync_folder(); }
  [[nodiscard]] Result<void> reopen() override { return disk_->reopen(); }

 private:
  std::shared_ptr<checkpoint::SimulatedDisk> disk_;
};

constexpr std::int64_t kSoundNs = 3 * kSecond;
constexpr std::int64_t kServiceRestartNs = kSecond;  // as systemd does with a service that failed
constexpr std::int64_t kEngineRestartNs = kSecond / 2, kTakeoverNs = 4 * kSecond;
constexpr std::int64_t kOperatorNs = 6 * kSecond;  // without any live server

}  // namespace

Server::Server(Stage& stage, std::string name, transport::ClientId standby_id, std::uint32_t rank)
    : Actor(stage, std::move(name)),
      disk_(std::make_shared<checkpoint::SimulatedDisk>()),
      rank_(rank),
      standby_id_(standby_id) {}

Server::~Server() = default;

std::vector<transport::ParticipantId> Server::participants() const {
  if (!port_) return {};
  return {port_->self()};
}

bool Server::runs() const { return up() && host_ && host_->state() == host::Host::State::kRunning; }

void Service::look() {
  const Server* live = nullptr;
  int running = 0;
  for (const Server* server : stage_.servers) {
    if (!server->runs()) continue;
    ++running;
    live = server;
  }
  if (running != 1) live = nullptr;
  const Epoch epoch = live == nullptr ? 0 : live->host()->session().epoch;
  if (live != live_ || epoch != epoch_) since_ns_ = stage_.now_ns;
  live_ = live;
  epoch_ = epoch;
}

std::int64_t Service::serves_for_ns() const {
  return live_ == nullptr ? 0 : std::min(stage_.now_ns - since_ns_, live_->well_for_ns());
}

void Server::on_start() {
  if (rank_ > 0 || std::exchange(swapped_, false)) {
    stand_by();
  } else {
    begin();
  }
}

void Server::begin() {
  port_ = std::move(*stage_.network.make_server("default"));
  engine_ = make_engine();
  host::HostConfig config = host_config(stage_.settings);
  config.epoch = static_cast<Epoch>(wall_ns() / kMs);
  made_ = std::make_unique<checkpoint::Keeper>(checkpoint::Settings{"disk", 1, false},
                                               std::make_unique<Mounted>(disk_), &Clock::shown,
                                               checkpoint::WritesIn::kWriteNow);
  keeper_ = made_.get();
  const auto newest = newest_on_disk();
  const auto start = keeper_->start(host::checkpoint_world(config), *engine_);
  if (!start) {
    tell("cannot start: " + start.error().message);
    drop();
    ended(stage_.now_ns + kServiceRestartNs);
    return;
  }
  for (const std::string& warning : start->warnings) tell(warning);
  const auto found = start->goes_on_from;
  const checkpoint::Moment from =
      found ? checkpoint::Moment{found->epoch, found->frame} : checkpoint::Moment{};
  if (newest && from < *newest)
    blame("newest checkpoint", "goes on from frame " + std::to_string(from.frame) + " of epoch " +
                                   std::to_string(from.epoch) + ", but frame " +
                                   std::to_string(newest->frame) + " of epoch " +
                                   std::to_string(newest->epoch) + " is on the disk");
  engine_->frame = from.frame;
  host::begin_from(*start, config);
  epoch_ = config.epoch;
  if (found)
    for (const checkpoint::ClientState& client : found->clients) stage_.known_ids[client.id] = epoch_;
  if (start->newest_epoch >= epoch_)
    blame("newest checkpoint", "epoch " + std::to_string(epoch_) + " is not above the folder's");
  check_start(*start);
  tell(start->told);
  begin_host(std::move(config));
}

void Server::begin_host(host::HostConfig config) {
  epoch_ = config.epoch;
  auto made = host::Host::create(std::move(config), *engine_, *port_);
  if (!made) throw std::runtime_error(made.error().message);
  host_ = std::move(*made);
  keeping_.emplace(
      std::move(made_), [this](const std::string& line, bool /*warning*/) { tell(line); }, &Clock::shown);
  if (const std::string wrong =
          stage_.truth.begin(epoch_, host_->session().continues_epoch, host_->session().continues_frame);
      !wrong.empty())
    blame("one world", wrong);
  tell("epoch " + std::to_string(epoch_));
  acts_seen_ = engine_->acted.size();
  last_frame_ns_ = last_poll_ns_ = stage_.now_ns;
  told_state_ = host::Host::State::kClaiming;
  write_at_ns_.reset();
  static_cast<void>(stage_.truth.hold(epoch_, host_->first_made(), host_->frame(), host_->hash()));
}

void Server::stand_by() {
  port_ = std::move(*stage_.network.make_server("default"));
  engine_ = make_engine();
  const host::HostConfig config = host_config(stage_.settings);
  made_ = std::make_unique<checkpoint::Keeper>(checkpoint::Settings{"disk", 1, false},
                                               std::make_unique<Mounted>(disk_), &Clock::shown,
                                               checkpoint::WritesIn::kWriteNow);
  keeper_ = made_.get();
  const auto accept = [this, world = host::checkpoint_world(config)](
                          const checkpoint::Checkpoint& checkpoint,
                          const transport::SessionMessage& /*live*/) -> Result<void> {
    return load_world(checkpoint, world, *engine_);
  };
  const auto follows = [this](const checkpoint::Checkpoint& from,
                              std::span<const transport::JournalMessage> journal) {
    return engine_->load(from.engine_state) &&
           host::roll_forward(host_config(stage_.settings), *engine_, from, journal);
  };
  static_cast<void>(port_->open_streams(static_cast<std::uint32_t>(config.streams.size())));
  auto made = standby::Standby::create({.session = "default",
                                        .id = standby_id_++,
                                        .rank = rank(),
                                        .epoch = static_cast<Epoch>(wall_ns() / kMs)},
                                       *port_, accept, follows);
  if (!made) throw std::runtime_error(made.error().message);
  standby_ = std::move(*made);
  no_live_since_ns_ = stage_.now_ns;
  tell("stands by");
}

void Server::check_takeover(const standby::Takeover& takeover, Frame from) const {
  const Epoch epoch = takeover.checkpoint->epoch;
  const Frame last = stage_.truth.lineage(epoch)->last;
  const std::string what =
      " frame " + std::to_string(from) + ", and the live server was at frame " + std::to_string(last);
  if (takeover.handed_over && from != last && well_for_ns() > kSoundNs)
    return blame("at most a second", "is handed" + what);
  // It had the time to receive a checkpoint, and each second another.
  if (stage_.crashed_epoch == epoch && well_for_ns() > 8 * kSecond &&
      static_cast<double>(last - from) > 1 + stage_.settings.frame_rate_hz)
    blame("at most a second", "takes over from" + what);
  if (takeover.handed_over) return;
  for (const Server* other : stage_.servers)
    if (other != this && other->comes_before(*this, epoch))
      blame("one world", "takes over, and " + other->name() + " comes before it");
}

// It could have taken over, and both have seen each other long enough.
bool Server::comes_before(const Server& other, Epoch epoch) const {
  return up() && standby_ && rank() < other.rank() && standby_->follows() == epoch && standby_->holds() > 0 &&
         std::min(well_for_ns(), other.well_for_ns()) > 8 * kSecond;
}

void Server::take_over() {
  const standby::Takeover takeover = standby_->take_over();
  host::HostConfig config = host_config(stage_.settings);
  auto continued = host::continue_world(config, *engine_, *takeover.checkpoint, takeover.journal);
  if (!continued) throw std::runtime_error(continued.error().message);
  if (!continued->why_not.empty()) blame("one world", "cannot follow the journal: " + continued->why_not);
  const checkpoint::Checkpoint& world = continued->world;
  engine_->frame = world.frame;
  tell("takes over from epoch " + std::to_string(world.epoch) + " at frame " + std::to_string(world.frame) +
       ", " + std::to_string(world.frame - takeover.checkpoint->frame) + " after its checkpoint");
  for (const checkpoint::ClientState& client : world.clients) taken_over_.push_back(client.id);
  check_takeover(takeover, world.frame);
  config.epoch = standby_->epoch_at(wall_ns() / kMs);
  standby_.reset();
  const auto newest = keeper_->take_over(host::checkpoint_world(config), *engine_);
  if (!newest) throw std::runtime_error(newest.error().message);
  checkpoint::Start start;
  start.newest_epoch = *newest;
  start.goes_on_from = std::make_shared<const checkpoint::Checkpoint>(std::move(continued->world));
  host::begin_takeover(std::move(start), takeover.from, config);
  for (const transport::ClientId id : std::exchange(taken_over_, {})) stage_.known_ids[id] = config.epoch;
  before_.reset();
  disturb();
  begin_host(std::move(config));
}

// Without the keeper: what a reader of all files finds.
std::optional<checkpoint::Moment> Server::newest_on_disk() const {
  std::optional<checkpoint::Moment> newest;
  const std::vector<std::string> files = disk_->list().value();
  for (const std::string& file : files) {
    const auto moment = checkpoint::moment_of(file);
    if (!moment || (newest && *moment < *newest)) continue;
    const auto bytes = disk_->read(file, checkpoint::kMaxFileBytes);
    if (bytes && checkpoint::decode(*bytes)) newest = moment;
  }
  return newest;
}

void Server::check_start(const checkpoint::Start& start) {
  if (!before_) return;
  const Before before = *std::exchange(before_, std::nullopt);
  const Frame from = start.goes_on_from ? start.goes_on_from->frame : 0;
  const bool same = start.goes_on_from && start.goes_on_from->epoch == before.epoch;
  if (!before.sound || before.frame == 0) return;
  if (before.orderly && (!same || from != before.frame)) {
    blame("at most a second", "ended in order at frame " + std::to_string(before.frame) +
                                  ", and goes on from frame " + std::to_string(from));
    return;
  }
  const double allowed_s = static_cast<double>(Rules::kCheckpointNs + 4 * disk_delay_ns_) / 1e9;
  const double lost_s =
      static_cast<double>(before.frame - std::min(from, before.frame)) / stage_.settings.frame_rate_hz;
  if (!same || lost_s > allowed_s + 1.5 / stage_.settings.frame_rate_hz)
    blame("at most a second",
          "was at frame " + std::to_string(before.frame) + " of epoch " + std::to_string(before.epoch) +
              ", and goes on from frame " + std::to_string(from) +
              (start.goes_on_from ? " of epoch " + std::to_string(start.goes_on_from->epoch)
                                  : " of a new world"));
}

std::unique_ptr<WatchedEngine> Server::make_engine() const {
  if (stage_.settings.engine_process) return std::make_unique<DoorEngine>(stage_);
  return std::make_unique<WatchedEngine>(stage_.settings.scene);
}

void Server::kill_engine() {
  if (engine_) engine_->die();
}

void Server::set_engine_stopped(bool stopped) {
  if (engine_) engine_->set_stopped(stopped);
}

bool Server::ends_with_engine() {
  const std::string why = engine_->failure();
  if (why.empty()) return false;
  tell(why);
  const bool others_wait = host_ && host_->wants_checkpoints();
  if (host_) before_ = Before{epoch_, host_->frame(), last_frame_ns_, false, false};
  drop();
  ended(stage_.now_ns + (others_wait ? kTakeoverNs : kEngineRestartNs));
  return true;
}

void Server::drop() {
  keeping_.reset();
  host_.reset();
  standby_.reset();
  made_.reset();
  keeper_ = nullptr;
  engine_.reset();
  port_.reset();
  if (stage_.live_epoch == epoch_) stage_.live_epoch = 0;
  write_at_ns_.reset();
}

void Server::on_crash(bool power_fails) {
  if (host_) {
    stage_.crashed_epoch = well_for_ns() > kSoundNs ? epoch_ : 0;
    const bool disk_well = stage_.now_ns - disk_trouble_ns_ > kSoundNs && disk_delay_ns_ < 10 * kMs &&
                           disk_->fails_with.empty() && !disk_->lies;
    before_ = Before{epoch_, host_->frame(), last_frame_ns_, false,
                     disk_well && well_for_ns() > kSoundNs && (disk_sound_ || !power_fails)};
  }
  drop();
  if (power_fails) lose_power(power_kept_);
}

void Server::lose_power(double kept) {
  const bool full = !disk_->fails_with.empty();
  const bool lies = disk_->lies;
  const auto changes =
      static_cast<std::size_t>(std::lround(kept * static_cast<double>(disk_->unsynced_changes())));
  *disk_ = disk_->after_power_loss(changes, static_cast<std::size_t>(kept * 1000), 1000);
  if (full) set_disk_full(true);
  disk_->lies = lies;
}

void Server::on_leave() {
  if (host_ && host_->state() == host::Host::State::kRunning) {
    // It waits a second for the step under way; then there is no checkpoint of the end.
    if (host_->frame_under_way() && engine_->finish_step()) {
      if (host_->poll(steady_ns(), wall_ns())) note_frame();
      note_acts();
    }
    const bool disk_well = disk_->fails_with.empty() && !host_->frame_under_way();
    keeping_->end(*host_);
    static_cast<void>(host::drain(host_->outbox(), *port_));
    before_ = Before{epoch_, host_->frame(), last_frame_ns_, true, disk_well};
  }
  tell("ends in order");
  drop();
}

std::int64_t Server::due_ns() const {
  if (standby_) return standby_->next_wake_ns();
  if (!host_) return INT64_MAX;
  std::int64_t due_ns = host_->next_wake_ns();
  if (write_at_ns_) due_ns = std::min(due_ns, clock().steady_ns(*write_at_ns_));
  return due_ns;
}

void Server::on_poll() {
  if (write_at_ns_ && stage_.now_ns >= *write_at_ns_) write_checkpoint();
  if (!up() || ends_with_engine()) return;
  if (standby_) {
    const bool is_time = standby_->poll(steady_ns());
    for (const auto& notice : standby_->take_notices()) tell(notice.text);
    if (!is_time) {
      call_operator();
      return;
    }
    take_over();
  }
  for (int turns = 0; turns < 8; ++turns) {  // as a loop that catches up
    const bool produced = host_->poll(steady_ns(), wall_ns());
    note_acts();
    keeping_->after_poll(*host_, produced, steady_ns());
    if (produced) note_frame();
    if (publishing_) static_cast<void>(host::drain(host_->outbox(), *port_));
    if (!produced || host_->next_wake_ns() > steady_ns()) break;
  }
  last_poll_ns_ = stage_.now_ns;
  for (const std::string& notice : host_->take_notices()) tell(notice);
  if (ends_with_engine()) return;
  const bool handed_over = host_->state() == host::Host::State::kHandedOver;
  if (host_->error() || handed_over) {
    tell(handed_over ? "is handed over" : "ends: " + host_->error()->message);
    if (host_->state() == host::Host::State::kEnded) blame("one world", host_->error()->message);
    swapped_ = stage_.settings.swaps;
    drop();
    ended(stage_.now_ns + kServiceRestartNs);
    return;
  }
  if (host_->state() != told_state_) {
    if (told_state_ == host::Host::State::kClaiming)
      if (const std::string wrong = stage_.truth.announce(epoch_); !wrong.empty()) blame("one world", wrong);
    told_state_ = host_->state();
    last_frame_ns_ = stage_.now_ns;
    if (told_state_ == host::Host::State::kRunning) {
      stage_.live_epoch = epoch_;
      disturb();
      tell("runs");
    }
  }
}

// One of the servers has to begin a world.
void Server::call_operator() {
  const bool any = std::ranges::any_of(stage_.servers, [](const Server* server) { return server->runs(); });
  if (rank_ > 0 || any) no_live_since_ns_ = stage_.now_ns;
  if (stage_.now_ns - no_live_since_ns_ < kOperatorNs) return;
  tell("is started again, as the live server");
  drop();
  ended(stage_.now_ns);
}

void Server::note_acts() {
  for (; acts_seen_ < engine_->acted.size(); ++acts_seen_) {
    const auto& [frame, value] = engine_->acted[acts_seen_];
    if (const std::string wrong = stage_.truth.act(epoch_, value, frame); !wrong.empty())
      blame("acts once", wrong);
  }
}

void Server::note_frame() {
  const host::FrameReport& report = host_->report();
  stage_.truth.made(epoch_, report.frame);
  for (const host::DeltaReport& delta : report.deltas) {
    stage_.journal.fold(delta.hash);
    if (const std::string wrong = stage_.truth.hold(epoch_, delta.stream, report.frame, delta.hash);
        !wrong.empty())
      blame("same state", wrong);
  }
  const std::int64_t waited_ns = stage_.now_ns - std::exchange(last_frame_ns_, stage_.now_ns);
  const auto period_ns = static_cast<std::int64_t>(1e9 / stage_.settings.frame_rate_hz);
  // Two looks of the server, of 50 ms each, besides.
  if (waited_ns > longest_wait_ns() + 2 * period_ns + 120 * kMs && well_for_ns() > waited_ns)
    blame("waiting", "frame " + std::to_string(report.frame) + " came " + std::to_string(waited_ns / kMs) +
                         " ms after the one before");
  if (keeper_->writing() && !write_at_ns_) write_at_ns_ = stage_.now_ns + disk_delay_ns_;
}

// One that prepares a handover gives up after 10 s, and one that waits for its successor after 3 s.
std::int64_t Server::longest_wait_ns() const {
  const bool may_wait = stage_.now_ns - stage_.handover_ns < 14 * kSecond;
  return may_wait ? Rules::kHandoverNs + Rules::kStallNs : Rules::kStallNs;
}

void Server::write_checkpoint() {
  write_at_ns_.reset();
  if (!tear_) {
    keeper_->write_now();
    if (disk_sound_ && disk_->fails_with.empty()) check_folder();
    return;
  }
  const Tear tear = *std::exchange(tear_, std::nullopt);
  disk_->power_fails_at = disk_->steps + tear.step;
  keeper_->write_now();
  disk_->power_fails_at.reset();
  tell("the power fails in step " + std::to_string(tear.step) + " of a write");
  power_kept_ = tear.kept;
  crash(stage_.now_ns + tear.back_after_ns, true);
}

void Server::check_folder() {
  const std::vector<std::string> names = disk_->list().value();
  const auto files =
      std::ranges::count_if(names, [](const auto& name) { return checkpoint::moment_of(name).has_value(); });
  if (files > static_cast<std::ptrdiff_t>(checkpoint::Folder::kKept))
    blame("memory", std::to_string(files) + " checkpoints are kept");
}

void Server::set_disk_delay(std::int64_t ns) {
  disk_delay_ns_ = std::max(ns, 2 * kMs);
  disk_trouble_ns_ = stage_.now_ns;
}

void Server::set_disk_full(bool full) {
  disk_->fails_with = full ? "No space left on device" : "";
  disk_trouble_ns_ = stage_.now_ns;
}

void Server::set_disk_lies(bool lies) {
  disk_->lies = lies;
  if (lies) disk_sound_ = false;
  disk_trouble_ns_ = stage_.now_ns;
}

void Server::tear_next_write(std::uint64_t salt, double kept, std::int64_t back_after_ns) {
  tear_ = Tear{salt % 8, kept, back_after_ns};
}

void Server::set_publishing(bool publishing) {
  publishing_ = publishing;
  disturb();
}

void Server::change_quality(std::uint64_t salt) {
  if (!up() || paused() || !host_ || host_->state() != host::Host::State::kRunning) return;
  Dice dice(salt);
  StreamParameters parameters = host_->parameters();
  CodecParameters& codec = parameters.codec;
  codec.threshold = std::max(1, static_cast<int>(codec.threshold * dice.uniform(0.5, 2)));
  codec.position_step = std::max(1, static_cast<int>(codec.position_step * dice.uniform(0.5, 2)));
  codec.velocity_step = std::max(1, static_cast<int>(codec.velocity_step * dice.uniform(0.5, 2)));
  if (!host_->set_parameters(parameters)) tell("other parameters are refused");
}

void Server::check() {
  if (!host_) return;
  const auto limits = host::Outbox::Limits();
  if (host_->outbox().high_water() > std::size_t{8} * limits.frames * 8 + limits.snapshots + limits.control)
    blame("memory", std::to_string(host_->outbox().high_water()) + " messages were queued");
  if (host_->state() != host::Host::State::kRunning) return;
  const auto period_ns = static_cast<std::int64_t>(1e9 / stage_.settings.frame_rate_hz);
  const std::int64_t waits_ns = stage_.now_ns - last_frame_ns_;
  if (waits_ns > 2 * (longest_wait_ns() + 2 * period_ns + 120 * kMs) && well_for_ns() > waits_ns)
    blame("waiting", "no frame for " + std::to_string(waits_ns / kMs) + " ms");
}

}  // namespace tandem::world
