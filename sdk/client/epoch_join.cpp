// Joins a stream, for the first time or while another is played, and handles losses.
#include <utility>

#include "sdk/client/followed_epoch.hpp"

namespace tandem::client {

std::optional<transport::SnapshotMessage> FollowedEpoch::join(Follower& to, Now now) {
  TANDEM_ASSERT(to.joining());
  const auto open = [&] {
    if (auto opened = to.open(client_.port, session_, client_.options.id); !opened) {
      client_.log(LogLevel::kError, opened.error().message);
      return false;
    }
    return true;
  };
  if (!open()) return std::nullopt;
  if (to.ask(now.steady_ns)) {
    if (to.suspects_deltas()) {
      to.forget_deltas(client_.port);
      static_cast<void>(open());  // again at the next poll
    }
    open_snapshots(to);
  }
  auto snapshot = to.choose_snapshot(now.steady_ns);
  if (!snapshot) return snapshot;
  if (auto loaded = to.load(*snapshot, client_.port, now.steady_ns); !loaded) {
    ++client_.statistics.refused_messages;
    if (loaded.error().code == ErrorCode::kMismatch) ++client_.statistics.hash_mismatches;
    client_.log(LogLevel::kWarning, "snapshot refused: " + loaded.error().message);
    snapshot.reset();
  }
  return snapshot;
}

// Another snapshot was asked for.
void FollowedEpoch::open_snapshots(const Follower& to) {
  if (auto opened = to.open_snapshots(client_.port); !opened)
    client_.log(LogLevel::kError, opened.error().message);
  client_.ack_due = true;
}

void FollowedEpoch::join_played(Now now) {
  if (!is_told_ && !settle_choice(now)) return;
  const auto snapshot = join(played(), now);
  if (!snapshot) return;
  follow_uncorrected();
  if (client_.pictures.wanted()) pictures_.on_loaded(played().timeline(), pacer_, now.steady_ns);
  has_loaded_ = true;
  frames_since_join_ = 0;
  frame_cost_ns_ = 0;
  client_.ack_due = true;
  client_.statistics.join_ns = now.steady_ns - join_began_ns_;
  client_.listener.on_snapshot(*snapshot);
  client_.news.on_loaded(played().timeline());
  client_.log(LogLevel::kInfo, "playing from frame " + std::to_string(snapshot->frame));
}

// A state is wanted again, while it plays.
void FollowedEpoch::fetch_state(Now now) {
  if (played().ask(now.steady_ns)) open_snapshots(played());
  const auto snapshot = played().choose_snapshot(now.steady_ns);
  if (!snapshot) return;
  client_.ack_due = true;
  if (const auto loss = played().fetch(*snapshot, scheduled_, client_.port)) on_loss(*loss, now);
}

// Starts from the current agreed state.
void FollowedEpoch::follow_uncorrected() {
  if (played().joining()) return;
  pictures_.draw_instead(nullptr);
  uncorrected_.reset();
  if (!client_.shows_uncorrected) return;
  uncorrected_.emplace(stream().layout, played().timeline());
  pictures_.draw_instead(&uncorrected_->state());
}

void FollowedEpoch::count(const Follower::Loss& loss) {
  if (loss.reason == ResyncReason::kMismatch) ++client_.statistics.hash_mismatches;
  if (loss.reason == ResyncReason::kRefused) ++client_.statistics.refused_messages;
}

void FollowedEpoch::on_loss(const Follower::Loss& loss, Now now) {
  count(loss);
  client_.listener.on_resync(loss.reason);
  if (played().joining()) return;
  ++client_.statistics.resyncs;
  ++client_.statistics.resyncs_by_reason[static_cast<std::size_t>(loss.reason)];
  if (loss.reason == ResyncReason::kMismatch && frames_since_join_ < kSettledFrames) {
    ++wrong_joins_;
    played().forget_deltas(client_.port);  // they may be forged, and would spoil the next join as well
  }
  const bool lost_on_the_way = loss.reason == ResyncReason::kGap || loss.reason == ResyncReason::kLostPart ||
                               loss.reason == ResyncReason::kMissingInput;
  if (lost_on_the_way) chooser_.on_loss(now.steady_ns);
  if (loss.reason != ResyncReason::kLag || !std::exchange(told_lag_, true)) {
    client_.log(LogLevel::kWarning, "joining again: " + loss.text());
  }
  join_began_ns_ = now.steady_ns;
  if (change_) {  // the client is on its way anyway
    move_over(now);
    return;
  }
  played().join_again(now.steady_ns);
}

}  // namespace tandem::client
