// Which stream is played, and the way over into another one: idl/STATES.md, "Changing the stream".
#include <algorithm>
#include <utility>

#include "sdk/client/client_core.hpp"
#include "sdk/client/session/session_check.hpp"
#include "sdk/transport/units.hpp"

namespace tandem::client {
namespace {

// A change that gets nowhere for so long is given up.
constexpr std::int64_t kChangePatienceNs = 10 * kSecond;
// Frames of the other stream that one poll applies, beside those of the one that is played.
constexpr int kFramesPerPoll = 16;

}  // namespace

Result<FollowedStream> ClientCore::choose_stream(const transport::SessionMessage& session) {
  const auto playable = playable_streams(session);
  if (!playable) return tl::unexpected<Error>(playable.error());
  const bool choice = playable->size() > 1 && preference_.kind != StreamPreference::Kind::kNamed;
  if (choice && !own_step_ns_) own_step_ns_ = measure_own_step(options_.measure_ns);
  chooser_.emplace(list_offers(session, *playable), preference_, 1e9 / session.frame_rate_hz, own_step_ns_);
  return follow(session);
}

// The one that is chosen: it was found playable, so making its timeline again cannot fail.
Result<FollowedStream> ClientCore::follow(const transport::SessionMessage& session) const {
  const transport::StreamMessage& stream = session.streams[chooser_->chosen().index];
  return ClientTimeline::create(stream.layout).map([&](ClientTimeline&& timeline) {
    timeline.set_clock(options_.measure_ns);
    return FollowedStream(stream, std::move(timeline), join_attempt());
  });
}

void ClientCore::prefer(std::string_view preference) {
  preference_ = read_preference(preference);
  if (chooser_) chooser_->prefer(preference_);
}

void ClientCore::tell_stream() {
  const StreamOffer& chosen = chooser_->chosen();
  const Layout& layout = epoch_->played.stream.layout;
  log(LogLevel::kInfo,
      "stream " + chosen.name + " (" + layout.predictor + ", " + layout.codec + "): " + chooser_->reason());
  listener_.on_stream(epoch_->played.stream);
}

void ClientCore::consider_streams(Now now) {
  EpochState& e = *epoch_;
  inbox_.statuses.clear();
  port_.take(inbox_.statuses);
  for (const auto& received : inbox_.statuses) {
    if (received.from != e.server || received.message.epoch != e.session.epoch) continue;
    chooser_->on_status(received.message);
    listener_.on_server_status(received.message);
  }
  if (e.next) {
    follow_next(now);
    return;
  }
  const bool other = chooser_->reconsider(
      {.now_ns = now.steady_ns,
       .idle_since_ns = e.played.joining ? std::optional(e.played.heard_ns) : std::nullopt,
       .round_trip_ns = e.pacer.clock().round_trip_ns()});
  if (other) change_stream(now);
}

void ClientCore::change_stream(Now now) {
  EpochState& e = *epoch_;
  if (chooser_->chosen().id == e.played.stream.id) return;
  auto chosen = follow(e.session);
  if (!chosen) {
    chooser_->gave_up(now.steady_ns);
    log(LogLevel::kError, chosen.error().message);
    return;
  }
  if (!e.played.joining) {
    log(LogLevel::kInfo, "changing to stream " + chooser_->chosen().name + ": " + chooser_->reason());
    start_join(e.next.emplace(std::move(*chosen)), now);
    return;
  }
  join_instead(std::move(*chosen), now);
}

void ClientCore::join_instead(FollowedStream other, Now now) {
  EpochState& e = *epoch_;
  port_.close_stream(e.played.stream.id.id);
  e.played = std::move(other);
  e.join_began_ns = now.steady_ns;
  start_join(e.played, now);
  tell_stream();
}

// Frame by frame behind the one that is played, until both are at the same.
void ClientCore::follow_next(Now now) {
  EpochState& e = *epoch_;
  if (e.next->joining) {
    if (!join(*e.next, now)) {
      // A server that is silent altogether says nothing about this stream.
      if (now.steady_ns - statistics_.last_applied_ns > kSecond) e.next->heard_ns = now.steady_ns;
      if (now.steady_ns - e.next->heard_ns > kChangePatienceNs) give_up_change("nothing came", now);
      return;
    }
  }
  // Who is behind for long does not wait for what it left to catch up.
  const bool behind = static_cast<double>(e.played.assembly.size()) > e.session.frame_rate_hz;
  e.next->assembly.drop_through(e.next->timeline.applied());
  for (int i = 0; i < kFramesPerPoll && (behind || e.next->timeline.applied() < e.played.timeline.applied());
       ++i) {
    if (!apply_front(*e.next, now, 0)) break;
    e.next->assembly.pop();
  }
  if (!e.next) return;  // lost, and given up
  const Frame here = e.played.timeline.applied(), there = e.next->timeline.applied();
  if (there == here || (behind && there > here)) move_over(now);
}

void ClientCore::move_over(Now now) {
  EpochState& e = *epoch_;
  port_.close_stream(e.played.stream.id.id);
  const Frame left_at = e.played.timeline.applied();
  e.played = std::move(*e.next);
  e.next.reset();
  e.lag.reset();
  e.frame_cost_ns = 0;
  e.told_too_slow = false;
  ++statistics_.stream_changes;
  ack_due_ = true;
  if (!e.played.joining) show_other(left_at, now);
  tell_stream();
}

void ClientCore::show_other(Frame left_at, Now now) {
  EpochState& e = *epoch_;
  const ClientTimeline& timeline = e.played.timeline;
  follow_uncorrected();
  simulate_ahead(now);
  if (timeline.applied() == left_at) {
    e.pictures.on_changed(timeline, e.pacer, now.steady_ns);
  } else if (pictures_.wanted()) {
    e.pictures.on_loaded(timeline, e.pacer, now.steady_ns);
  }
  sent_.on_applied(timeline.applied(), now.steady_ns, outcomes_);
}

void ClientCore::give_up_change(const std::string& why, Now now) {
  EpochState& e = *epoch_;
  log(LogLevel::kWarning, "staying: stream " + chooser_->chosen().name + " cannot be joined, " + why);
  port_.close_stream(e.next->stream.id.id);
  e.played.joiner.continue_after(e.next->joiner.attempt());
  e.next.reset();
  chooser_->gave_up(now.steady_ns);
  ack_due_ = true;
}

// The same epoch with other streams: what is followed goes on, if it is still there.
void ClientCore::adopt_streams(const transport::SessionMessage& session, Now now) {
  EpochState& e = *epoch_;
  const auto still = [&session](const FollowedStream& followed) {
    return std::any_of(
        session.streams.begin(), session.streams.end(), [&](const transport::StreamMessage& stream) {
          return stream.id == followed.stream.id && stream.layout_hash == followed.stream.layout_hash;
        });
  };
  if (e.next && !still(*e.next)) give_up_change("it is not there any more", now);
  session_ = e.session = session;
  listener_.on_session(session);
  const bool goes_on = still(e.played);
  auto chosen = choose_stream(session);
  if (!chosen) {
    refuse(chosen.error());
    return;
  }
  if (e.next) chooser_->keep(e.next->stream.id, e.played.stream.id);
  if (goes_on) {
    if (!e.next) chooser_->keep(e.played.stream.id, e.played.stream.id);
    listener_.on_stream(e.played.stream);
    return;
  }
  log(LogLevel::kWarning, "the stream that was played is not there any more");
  if (e.next) {
    move_over(now);
    return;
  }
  join_instead(std::move(*chosen), now);
}

}  // namespace tandem::client
