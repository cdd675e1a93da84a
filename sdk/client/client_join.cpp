// The way into a stream: for the first time, again, or beside the one that is played.
#include <algorithm>
#include <utility>

#include "sdk/client/client_core.hpp"

namespace tandem::client {
FollowedStream* ClientCore::joined_stream() {
  if (epoch_->played.joining) return &epoch_->played;
  return epoch_->next && epoch_->next->joining ? &*epoch_->next : nullptr;
}

std::optional<transport::SnapshotMessage> ClientCore::join(FollowedStream& to, Now now) {
  if (!to.is_open) {
    if (auto opened = port_.open_stream(epoch_->session, to.stream, options_.id); !opened) {
      log(LogLevel::kError, opened.error().message);
      return std::nullopt;
    }
    to.is_open = true;
  }
  if (to.joiner.poll(now.steady_ns)) {
    if (auto opened = port_.open_snapshots(to.stream.id.id); !opened)
      log(LogLevel::kError, opened.error().message);
    to.repeat_ns = FollowedStream::kLeastRepeatNs;
    ack_due_ = true;
  }
  // The deltas in between were lost meanwhile, or sent before this client read them.
  if (to.snapshot.parts() > 0 && to.too_old(to.snapshot.frame())) {
    to.snapshot.reject();
    to.joiner.ask_again(now.steady_ns);
  }
  const CompleteDelta* first = to.assembly.front();
  auto snapshot =
      to.joiner.choose(first != nullptr ? std::optional(first->frame) : std::nullopt, now.steady_ns);
  if (snapshot && !load(to, *snapshot, now)) snapshot.reset();
  return snapshot;
}

bool ClientCore::load(FollowedStream& to, const transport::SnapshotMessage& snapshot, Now now) {
  auto loaded = to.timeline.load(snapshot.bytes, epoch_->session.epoch, to.stream.id);
  if (loaded && to.timeline.applied() != snapshot.frame) {
    loaded = fail(ErrorCode::kMalformed, "snapshot of another frame than announced");
  }
  if (!loaded) {
    ++statistics_.refused_messages;
    if (loaded.error().code == ErrorCode::kMismatch) ++statistics_.hash_mismatches;
    log(LogLevel::kWarning, "snapshot refused: " + loaded.error().message);
    to.snapshot.reject();
    to.joiner.ask_again(now.steady_ns);
    return false;
  }
  port_.close_snapshots(to.stream.id.id);
  to.snapshot.clear();
  to.assembly.drop_through(snapshot.frame);
  to.joining = false;
  to.input_missing_ns.reset();
  return true;
}

void ClientCore::begin(Now now) {
  EpochState& e = *epoch_;
  const auto snapshot = join(e.played, now);
  if (!snapshot) return;
  follow_uncorrected();
  if (pictures_.wanted()) e.pictures.on_loaded(e.played.timeline, e.pacer, now.steady_ns);
  e.has_played = true;
  e.frame_cost_ns = 0;
  ack_due_ = true;
  statistics_.join_ns = now.steady_ns - e.join_began_ns;
  listener_.on_snapshot(*snapshot);
  log(LogLevel::kInfo, "playing from frame " + std::to_string(snapshot->frame));
}

// From the agreed state as it is now.
void ClientCore::follow_uncorrected() {
  EpochState& e = *epoch_;
  e.pictures.draw_instead(nullptr);
  e.uncorrected.reset();
  if (!shows_uncorrected_) return;
  e.uncorrected.emplace(e.played.stream.layout, e.played.timeline);
  e.pictures.draw_instead(&e.uncorrected->state());
}

void ClientCore::lose(FollowedStream& from, ResyncReason reason, const std::string& why, Now now) {
  EpochState& e = *epoch_;
  const bool is_played = &from == &e.played;
  if (is_played) listener_.on_resync(reason);
  if (from.joining) {
    // Not playing yet: the buffer starts again, and the snapshot asked for may still fit what follows.
    if (reason != ResyncReason::kGap && reason != ResyncReason::kLostPart)
      from.joiner.ask_again(now.steady_ns);
    return;
  }
  if (!is_played) {
    give_up_change(why, now);
    return;
  }
  ++statistics_.resyncs;
  ++statistics_.resyncs_by_reason[static_cast<std::size_t>(reason)];
  const bool lost_on_the_way = reason == ResyncReason::kGap || reason == ResyncReason::kLostPart ||
                               reason == ResyncReason::kMissingInput;
  if (lost_on_the_way) chooser_->on_loss(now.steady_ns);
  if (reason != ResyncReason::kLag || !std::exchange(e.told_lag, true)) {
    log(LogLevel::kWarning, "joining again: " + why);
  }
  e.join_began_ns = now.steady_ns;
  e.lag.reset();
  if (e.next) {  // on its way anyhow
    move_over(now);
    return;
  }
  start_join(from, now);
}

void ClientCore::start_join(FollowedStream& to, Now now) {
  to.joining = true;
  to.heard_ns = now.steady_ns;
  to.input_missing_ns.reset();
  to.joiner.start(now.steady_ns);
}

}  // namespace tandem::client
