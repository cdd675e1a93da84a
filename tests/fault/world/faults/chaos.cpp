#include "tests/fault/world/faults/chaos.hpp"

#include <algorithm>
#include <utility>

namespace tandem::world {
namespace {

using transport::simulated::Bottleneck;
using transport::simulated::BottleneckOptions;
using transport::simulated::LinkModel;

constexpr std::int64_t seconds(double s) { return static_cast<std::int64_t>(s * 1e9); }

bool cuts(FaultKind kind) {
  return kind == FaultKind::kPartition || kind == FaultKind::kOneWay || kind == FaultKind::kIsolate;
}

bool changes_links(FaultKind kind) {
  return kind == FaultKind::kLoss || kind == FaultKind::kDelay || kind == FaultKind::kReorder ||
         kind == FaultKind::kDuplicate || kind == FaultKind::kThin || kind == FaultKind::kFlip ||
         kind == FaultKind::kTruncate || kind == FaultKind::kLostForGood;
}

bool of_the_server(FaultKind kind) {
  return kind == FaultKind::kSlowDisk || kind == FaultKind::kFullDisk || kind == FaultKind::kLostFsync ||
         kind == FaultKind::kStarvePublisher;
}

/// Faults after which nothing is wrong with anybody but for what they do themselves.
bool harmless(FaultKind kind) {
  return kind == FaultKind::kForge || kind == FaultKind::kBurst || kind == FaultKind::kNewcomer ||
         kind == FaultKind::kQuality || kind == FaultKind::kSlowDisk || kind == FaultKind::kFullDisk ||
         kind == FaultKind::kLostFsync || kind == FaultKind::kTornWrite || kind == FaultKind::kHandover ||
         kind == FaultKind::kRepeat || kind == FaultKind::kSquat || kind == FaultKind::kLastWords;
}

void worsen(LinkModel& link, const Fault& fault, const std::shared_ptr<Bottleneck>& bottleneck) {
  switch (fault.kind) {
    case FaultKind::kLoss:
      link.loss = std::max(link.loss, fault.strength);
      break;
    case FaultKind::kDelay:
      link.delay_ns += seconds(fault.strength);
      break;
    case FaultKind::kReorder:
      link.jitter_ns += seconds(fault.strength);
      break;
    case FaultKind::kDuplicate:
      link.duplicates = std::max(link.duplicates, fault.strength);
      break;
    case FaultKind::kThin:
      link.bottleneck = bottleneck;
      break;
    case FaultKind::kFlip:
      link.flipped = std::max(link.flipped, fault.strength);
      break;
    case FaultKind::kTruncate:
      link.truncated = std::max(link.truncated, fault.strength);
      if (fault.salt % 4 != 0) {  // so that parts come one by one, and twice
        link.loss = std::max(link.loss, 0.3);
        link.delay_ns += 150 * kMs;
      }
      break;
    case FaultKind::kLostForGood:
      link.loss = std::max(link.loss, 0.1);
      link.lost_for_good = std::max(link.lost_for_good, fault.strength);
      break;
    default:
      break;
  }
}

}  // namespace

Chaos::Chaos(Stage& stage, Cast& cast, std::size_t newcomers_from, const Plan& plan, std::int64_t heal_at_ns)
    : stage_(stage), cast_(cast), newcomers_from_(newcomers_from), plan_(plan), heal_at_ns_(heal_at_ns) {}

std::size_t Chaos::index_of(std::uint32_t whom) const { return whom % cast_.size(); }

std::size_t Chaos::other_than(const Fault& fault) const {
  const std::size_t whom = index_of(fault.whom), other = index_of(fault.other);
  return other != whom ? other : (whom + 1) % cast_.size();
}

std::size_t Chaos::server_index(std::uint32_t whom) const {
  const std::size_t index = index_of(whom);
  return dynamic_cast<const Server*>(cast_[index].get()) != nullptr ? index : 0;
}

Server& Chaos::server(std::uint32_t whom) { return static_cast<Server&>(*cast_[server_index(whom)]); }

Server* Chaos::live_server() {
  for (const auto& any : cast_) {
    auto* const server = dynamic_cast<Server*>(any.get());
    if (server != nullptr && server->runs() && server->host()->session().epoch == stage_.live_epoch)
      return server;
  }
  return nullptr;
}

void Chaos::each_server(const std::function<void(Server&)>& change) {
  for (const auto& any : cast_)
    if (auto* const server = dynamic_cast<Server*>(any.get())) change(*server);
}

std::int64_t Chaos::wake_ns() const {
  std::int64_t wake_ns = healed_ ? INT64_MAX : heal_at_ns_;
  if (next_ < plan_.size()) wake_ns = std::min(wake_ns, plan_[next_].at_ms * kMs);
  for (const Active& active : active_) wake_ns = std::min({wake_ns, active.until_ns, active.speaks_at_ns});
  return wake_ns;
}

void Chaos::turn() {
  for (auto active = active_.begin(); active != active_.end();) {
    if (active->until_ns > stage_.now_ns) {
      ++active;
      continue;
    }
    const Active ended = std::move(*active);
    active = active_.erase(active);
    end(ended);
  }
  for (; next_ < plan_.size() && plan_[next_].at_ms * kMs <= stage_.now_ns; ++next_)
    if (stage_.now_ns < heal_at_ns_) begin(plan_[next_]);
  if (!healed_ && stage_.now_ns >= heal_at_ns_) heal();
  for (Active& active : active_) {
    disturb(active);
    if (stage_.now_ns >= active.speaks_at_ns) speak(active);
  }
  if (links_of_ != stage_.changes) set_links();
}

void Chaos::speak(Active& active) {
  if (active.fault.kind == FaultKind::kSquat) {
    active.forger->squat();
    active.speaks_at_ns = stage_.now_ns + 10 * kMs;
    return;
  }
  if (active.forger != nullptr) {
    active.forger->speak();
    active.speaks_at_ns = stage_.now_ns + seconds(1 / std::max(1.0, active.fault.strength * 10));
    return;
  }
  // As `tandem handover`, which repeats its command until it is heard.
  transport::CommandMessage command;
  command.epoch = stage_.live_epoch;
  command.session = "default";
  command.request = active.fault.salt;
  static_cast<void>(active.operates->write(command));
  stage_.handover_ns = stage_.now_ns;
  active.speaks_at_ns = stage_.now_ns + 250 * kMs;
}

void Chaos::disturb(const Active& active) {
  if (harmless(active.fault.kind)) return;
  if (of_the_server(active.fault.kind)) each_server([](Server& any) { any.disturb(); });
  actor(active.fault.whom).disturb();
  // One that is cut off from others disturbs nobody but itself.
  if (active.fault.kind == FaultKind::kPartition || active.fault.kind == FaultKind::kOneWay)
    cast_[other_than(active.fault)]->disturb();
}

void Chaos::begin(const Fault& fault) {
  Actor& whom = actor(fault.whom);
  const std::int64_t until_ns = std::min(heal_at_ns_, stage_.now_ns + fault.for_ms * kMs);
  stage_.journal.add(stage_.now_ns, "fault " + std::to_string(fault.id),
                     std::string(name_of(fault.kind)) + " of " + whom.name() + ", " + text_of(fault));
  Active active{.fault = fault, .until_ns = until_ns};
  switch (fault.kind) {
    case FaultKind::kCrash:
      if (whom.up()) whom.crash(until_ns);
      return;
    case FaultKind::kLeave:
      whom.leave(until_ns);
      return;
    case FaultKind::kPower:
      server(fault.whom).set_power_kept(fault.strength);
      if (server(fault.whom).up()) server(fault.whom).crash(until_ns, true);
      return;
    case FaultKind::kTornWrite:
      server(fault.whom).tear_next_write(fault.salt, fault.strength, fault.for_ms * kMs);
      return;
    case FaultKind::kWallJump:
      whom.clock().jump(seconds(fault.strength));
      return;
    case FaultKind::kBurst:
      whom.burst(static_cast<std::uint32_t>(fault.strength));
      return;
    case FaultKind::kRepeat:
      whom.repeat();
      return;
    case FaultKind::kQuality:
      server(fault.whom).change_quality(fault.salt);
      return;
    case FaultKind::kPreference:
      whom.prefer(fault.salt);
      return;
    case FaultKind::kNewcomer: {
      Actor& newcomer = *cast_[newcomers_from_ + fault.salt % 2];
      newcomer.start();
      active.fault.whom = static_cast<std::uint32_t>(newcomers_from_ + fault.salt % 2);
      break;
    }
    case FaultKind::kPause:
      whom.set_paused(true);
      break;
    case FaultKind::kDrift:
      whom.clock().set_drift(stage_.now_ns, static_cast<std::int64_t>(fault.strength * 1e6));
      break;
    case FaultKind::kStarve:
      whom.set_starved(seconds(fault.strength));
      break;
    case FaultKind::kStarvePublisher:
      each_server([&](Server& any) { any.set_publishing(false); });
      active.fault.whom = 0;
      break;
    case FaultKind::kSlowDisk:
      each_server([&](Server& any) { any.set_disk_delay(seconds(fault.strength)); });
      break;
    case FaultKind::kFullDisk:
      for (const auto& any : cast_) any->set_disk_full(true);
      break;
    case FaultKind::kLostFsync:
      each_server([&](Server& any) { any.set_disk_lies(true); });
      break;
    case FaultKind::kHang:
      active.fault.whom = static_cast<std::uint32_t>(server_index(fault.whom));
      server(fault.whom).set_hung(true);
      break;
    case FaultKind::kEngineDies:
      server(fault.whom).kill_engine();
      server(fault.whom).disturb();
      return;
    case FaultKind::kEngineStops:
      active.fault.whom = static_cast<std::uint32_t>(server_index(fault.whom));
      server(fault.whom).set_engine_stopped(true);
      break;
    case FaultKind::kHandover:
      active.operates = std::move(*stage_.network.make_commander("default"));
      active.speaks_at_ns = stage_.now_ns + 100 * kMs;
      break;
    case FaultKind::kLastWords:
      for (const auto& any : cast_) any->burst(static_cast<std::uint32_t>(fault.strength));
      break;
    case FaultKind::kSquat:
      active.until_ns = INT64_MAX;
      [[fallthrough]];
    case FaultKind::kForge:
      active.forger = std::make_unique<Forger>(stage_, fault.salt);
      active.speaks_at_ns = stage_.now_ns;
      break;
    case FaultKind::kThin:
      active.bottleneck = std::make_shared<Bottleneck>(
          BottleneckOptions{.bits_per_s = fault.strength * 1e3, .delay_ns = 0, .queue_ns = 300 * kMs});
      break;
    default:
      break;
  }
  const bool links = cuts(fault.kind) || changes_links(fault.kind);
  active_.push_back(std::move(active));
  disturb(active_.back());
  if (links) set_links();
}

void Chaos::end(const Active& active) {
  const Fault& fault = active.fault;
  Actor& whom = actor(fault.whom);
  const auto still = [&](const Active& other) {
    return other.fault.kind == fault.kind &&
           (of_the_server(fault.kind) || index_of(other.fault.whom) == index_of(fault.whom));
  };
  disturb(active);
  if (cuts(fault.kind) || changes_links(fault.kind)) return set_links();
  if (fault.kind == FaultKind::kLastWords) {
    if (Server* const live = live_server())
      live->crash(stage_.now_ns + static_cast<std::int64_t>(fault.salt % 3000) * kMs);
    return;
  }
  if (std::ranges::any_of(active_, still)) return;  // another one of this kind goes on
  if (fault.kind == FaultKind::kHang) whom.set_hung(false);
  if (fault.kind == FaultKind::kEngineStops) server(fault.whom).set_engine_stopped(false);
  if (fault.kind == FaultKind::kPause) whom.set_paused(false);
  if (fault.kind == FaultKind::kDrift) whom.clock().set_drift(stage_.now_ns, 0);
  if (fault.kind == FaultKind::kStarve) whom.set_starved(0);
  if (fault.kind == FaultKind::kNewcomer) whom.leave(INT64_MAX);
  if (fault.kind == FaultKind::kStarvePublisher) each_server([&](Server& any) { any.set_publishing(true); });
  if (fault.kind == FaultKind::kSlowDisk) each_server([&](Server& any) { any.set_disk_delay(0); });
  if (fault.kind == FaultKind::kFullDisk)
    for (const auto& any : cast_) any->set_disk_full(false);
  if (fault.kind == FaultKind::kLostFsync) each_server([&](Server& any) { any.set_disk_lies(false); });
}

void Chaos::heal() {
  healed_ = true;
  stage_.journal.add(stage_.now_ns, "faults", "end");
  for (Active& active : std::exchange(active_, {})) {
    if (active.until_ns == INT64_MAX) {
      active_.push_back(std::move(active));
    } else {
      end(active);
    }
  }
  each_server([&](Server& any) { any.keep_next_write_whole(); });
  set_links();
  for (std::size_t i = 0; i < newcomers_from_; ++i)
    if (!cast_[i]->up()) cast_[i]->start();
}

bool Chaos::concerns(const Active& active, std::size_t from, std::size_t to) const {
  const std::size_t whom = index_of(active.fault.whom);
  switch (active.fault.kind) {
    case FaultKind::kPartition: {
      const std::size_t other = other_than(active.fault);
      return (from == whom && to == other) || (from == other && to == whom);
    }
    case FaultKind::kOneWay:
      return from == whom && to == other_than(active.fault);
    default:
      return from == whom || to == whom;
  }
}

void Chaos::set_links() {
  links_of_ = stage_.changes;
  stage_.network.set_all_links(stage_.settings.link);
  for (std::size_t from = 0; from < cast_.size(); ++from) {
    for (std::size_t to = 0; to < cast_.size(); ++to) {
      if (from == to) continue;
      LinkModel link = stage_.settings.link;
      bool cut = false, changed = false;
      for (const Active& active : active_) {
        if (!concerns(active, from, to)) continue;
        cut = cut || cuts(active.fault.kind);
        if (!changes_links(active.fault.kind)) continue;
        changed = true;
        worsen(link, active.fault, active.bottleneck);
      }
      for (const auto& sender : cast_[from]->participants()) {
        for (const auto& receiver : cast_[to]->participants()) {
          if (changed) stage_.network.set_link(sender, receiver, link);
          stage_.network.set_cut_one_way(sender, receiver, cut);
        }
      }
    }
  }
}

}  // namespace tandem::world
