// Joins a stream, for the first time or while another is played, and handles losses.
#include <algorithm>
#include <utility>

#include "sdk/client/client_core.hpp"

namespace tandem::client {

std::optional<transport::SnapshotMessage> ClientCore::join(Follower& to, Now now) {
  if (auto opened = to.open(port_, epoch_->session, options_.id); !opened) {
    log(LogLevel::kError, opened.error().message);
    return std::nullopt;
  }
  if (to.ask(now.steady_ns)) {
    if (to.suspects_deltas()) {
      to.forget_deltas(port_);
      if (auto opened = to.open(port_, epoch_->session, options_.id); !opened)
        log(LogLevel::kError, opened.error().message);
    }
    if (auto opened = to.open_snapshots(port_); !opened) log(LogLevel::kError, opened.error().message);
    ack_due_ = true;
  }
  auto snapshot = to.choose_snapshot(now.steady_ns);
  if (!snapshot) return snapshot;
  if (auto loaded = to.load(*snapshot, port_, now.steady_ns); !loaded) {
    ++statistics_.refused_messages;
    if (loaded.error().code == ErrorCode::kMismatch) ++statistics_.hash_mismatches;
    log(LogLevel::kWarning, "snapshot refused: " + loaded.error().message);
    snapshot.reset();
  }
  return snapshot;
}

void ClientCore::begin(Now now) {
  EpochState& e = *epoch_;
  if (!e.is_chosen && !settle_choice(now)) return;
  const auto snapshot = join(*e.played, now);
  if (!snapshot) return;
  follow_uncorrected();
  if (pictures_.wanted()) e.pictures.on_loaded(e.played->timeline(), e.pacer, now.steady_ns);
  e.has_loaded = true;
  e.frames_since_join = 0;
  e.frame_cost_ns = 0;
  ack_due_ = true;
  statistics_.join_ns = now.steady_ns - e.join_began_ns;
  listener_.on_snapshot(*snapshot);
  log(LogLevel::kInfo, "playing from frame " + std::to_string(snapshot->frame));
}

// A state is wanted again, while it plays.
void ClientCore::fetch_state(Now now) {
  EpochState& e = *epoch_;
  if (e.played->ask(now.steady_ns)) {
    if (auto opened = e.played->open_snapshots(port_); !opened) log(LogLevel::kError, opened.error().message);
    ack_due_ = true;
  }
  const auto snapshot = e.played->choose_snapshot(now.steady_ns);
  if (!snapshot) return;
  ack_due_ = true;
  if (const auto loss = e.played->fetch(*snapshot, e.scheduled, port_)) on_loss(*loss, now);
}

// Starts from the current agreed state.
void ClientCore::follow_uncorrected() {
  EpochState& e = *epoch_;
  e.pictures.draw_instead(nullptr);
  e.uncorrected.reset();
  if (!shows_uncorrected_) return;
  e.uncorrected.emplace(e.played->stream().layout, e.played->timeline());
  e.pictures.draw_instead(&e.uncorrected->state());
}

void ClientCore::count(const Follower::Loss& loss) {
  if (loss.reason == ResyncReason::kMismatch) ++statistics_.hash_mismatches;
  if (loss.reason == ResyncReason::kRefused) ++statistics_.refused_messages;
}

void ClientCore::on_loss(const Follower::Loss& loss, Now now) {
  EpochState& e = *epoch_;
  count(loss);
  listener_.on_resync(loss.reason);
  if (e.played->joining()) return;
  ++statistics_.resyncs;
  ++statistics_.resyncs_by_reason[static_cast<std::size_t>(loss.reason)];
  if (loss.reason == ResyncReason::kMismatch && e.frames_since_join < kSettledFrames) {
    ++e.wrong_joins;
    e.played->forget_deltas(port_);  // they may be forged, and would spoil the next join as well
  }
  const bool lost_on_the_way = loss.reason == ResyncReason::kGap || loss.reason == ResyncReason::kLostPart ||
                               loss.reason == ResyncReason::kMissingInput;
  if (lost_on_the_way) chooser_->on_loss(now.steady_ns);
  if (loss.reason != ResyncReason::kLag || !std::exchange(e.told_lag, true)) {
    log(LogLevel::kWarning, "joining again: " + loss.text());
  }
  e.join_began_ns = now.steady_ns;
  if (e.change) {  // the client is on its way anyway
    move_over(now);
    return;
  }
  e.played->join_again(now.steady_ns);
}

}  // namespace tandem::client
