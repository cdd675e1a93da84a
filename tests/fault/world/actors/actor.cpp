#include "tests/fault/world/actors/actor.hpp"

#include <algorithm>
#include <utility>

namespace tandem::world {

Actor::Actor(Stage& stage, std::string name) : stage_(stage), name_(std::move(name)) {}

void Actor::start() {
  if (up_) return;
  up_ = true;
  back_at_ns_ = INT64_MAX;
  delivered_ = 0;
  not_before_ns_ = stage_.now_ns;
  disturb();
  clock_.show(stage_.now_ns);
  on_start();
  ++stage_.changes;
}

void Actor::crash(std::int64_t back_at_ns, bool power_fails) {
  if (up_) {
    set_paused(false);
    set_hung(false);
    for (const transport::ParticipantId& participant : participants()) stage_.network.kill(participant);
    up_ = false;
    clock_.show(stage_.now_ns);
    on_crash(power_fails);
  }
  ended(back_at_ns);
}

void Actor::leave(std::int64_t back_at_ns) {
  if (!up_ || paused()) return;
  up_ = false;
  clock_.show(stage_.now_ns);
  on_leave();
  ended(back_at_ns);
}

void Actor::ended(std::int64_t back_at_ns) {
  up_ = false;
  disturb();
  back_at_ns_ = back_at_ns_ == INT64_MAX ? back_at_ns : std::min(back_at_ns_, back_at_ns);
  ++stage_.changes;
}

void Actor::set_paused(bool paused) {
  if (!up_ || paused_ == paused) return;
  paused_ = paused;
  disturb();
  for (const transport::ParticipantId& participant : participants())
    stage_.network.set_frozen(participant, paused);
}

void Actor::set_hung(bool hung) {
  if (!up_ || hung_ == hung) return;
  hung_ = hung;
  disturb();
}

void Actor::set_starved(std::int64_t between_ns) {
  starved_ns_ = between_ns;
  if (between_ns == 0) not_before_ns_ = stage_.now_ns;
}

std::uint64_t Actor::delivered() const {
  std::uint64_t sum = 0;
  for (const transport::ParticipantId& participant : participants())
    sum += stage_.network.delivered_to(participant);
  return sum;
}

std::int64_t Actor::wake_ns() const {
  if (!up_) return back_at_ns_;
  if (paused()) return INT64_MAX;
  return std::max(not_before_ns_, std::min(arrival_ns(), clock_.world_ns(due_ns())));
}

void Actor::turn() {
  if (!up_) {
    if (stage_.now_ns >= back_at_ns_) start();
    return;
  }
  if (paused() || stage_.now_ns < not_before_ns_) return;
  if (stage_.now_ns < std::min(arrival_ns(), clock_.world_ns(due_ns()))) {
    const std::uint64_t delivered = this->delivered();
    if (delivered == delivered_) return;
    delivered_ = delivered;
  }
  clock_.show(stage_.now_ns);
  on_poll();
  not_before_ns_ = stage_.now_ns + starved_ns_;
}

}  // namespace tandem::world
