#include "services/host/succession/handover.hpp"

#include <fmt/format.h>

#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {

void Handover::ask(const Standbys& standbys, Frame frame, Notices& notices, std::int64_t now_ns) {
  if (step_ != Step::kNone) return;
  const Standbys::KnownStandby* const to = standbys.first_ready(now_ns);
  if (to == nullptr) {
    notices.add("a handover was asked for, but no server that stands by is ready", now_ns);
    return;
  }
  step_ = Step::kPreparing;
  to_ = to->id;
  asked_ = frame;
  told_ = false;
  since_ns_ = now_ns;
  notices.add(fmt::format("hands over to server {:016x} of rank {}", to->id, to->rank), now_ns);
}

void Handover::look(const Standbys& standbys, Notices& notices, std::int64_t now_ns) {
  if (step_ == Step::kNone) return;
  const Standbys::KnownStandby* const to = standbys.find(to_);
  const bool stopped = step_ == Step::kStopped;
  if (stopped && !std::exchange(told_, true)) notices.add("made the last frame before the handover", now_ns);
  if (to == nullptr && !stopped) return give_up("it stands by no longer", notices, now_ns);
  if (now_ns - since_ns_ >= (stopped ? kWaitsNs : kPreparesNs))
    return give_up(stopped ? "it does not take over" : "it is too far behind", notices, now_ns);
  if (step_ == Step::kPreparing && to->holds_frame > asked_) step_ = Step::kLastFrame;
}

bool Handover::made(std::int64_t now_ns) {
  if (step_ != Step::kLastFrame) return false;
  step_ = Step::kStopped;
  since_ns_ = now_ns;
  return true;
}

void Handover::give_up(const std::string& why, Notices& notices, std::int64_t now_ns) {
  TANDEM_ASSERT(step_ != Step::kNone);
  step_ = Step::kNone;
  notices.add(fmt::format("the handover to server {:016x} failed, so this server goes on: {}", to_, why),
              now_ns);
}

}  // namespace tandem::host
