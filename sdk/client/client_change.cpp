// Chooses the stream that is played, and changes to another one: idl/STATES.md, "Changing the stream".
#include <algorithm>
#include <utility>

#include "sdk/client/client_core.hpp"
#include "sdk/client/session/session_check.hpp"

namespace tandem::client {

namespace {
constexpr std::string_view kUnplayable =
    "this client computes the stream differently from the server: the state soon differed after each of "
    "several snapshots";
// A server tells once a second what each of its streams takes.
constexpr std::int64_t kStatusPatienceNs = 1200 * kMillisecond;
}  // namespace

Result<std::unique_ptr<Follower>> ClientCore::choose_stream(const transport::SessionMessage& session,
                                                            Now now) {
  auto playable = playable_streams(session);
  if (!playable) return tl::unexpected<Error>(playable.error());
  const auto unplayable = [&](std::size_t index) {
    return epoch_ &&
           std::count(epoch_->unplayable.begin(), epoch_->unplayable.end(), session.streams[index].id) > 0;
  };
  std::erase_if(*playable, unplayable);
  if (playable->empty()) return fail(ErrorCode::kMismatch, std::string(kUnplayable));
  const bool choice = playable->size() > 1 && preference_.kind != StreamPreference::Kind::kNamed;
  if (choice && !own_step_ns_) own_step_ns_ = measure_own_step(options_.measure_ns);
  chooser_.emplace(list_offers(session, *playable), preference_, 1e9 / session.frame_rate_hz, own_step_ns_);
  choice_due_ns_ = now.steady_ns + kStatusPatienceNs;
  return follow(session, now);
}

bool ClientCore::settle_choice(Now now) {
  EpochState& e = *epoch_;
  if (now.steady_ns < choice_due_ns_ && chooser_->wants_status()) return false;
  if (choice_due_ns_ != 0) {
    chooser_->choose_anew();
    if (chooser_->chosen().id != e.played->stream().id) {
      auto chosen = follow(e.session, now);
      if (!chosen) {
        log(LogLevel::kError, chosen.error().message);
        return false;
      }
      e.played = std::move(*chosen);
    }
    choice_due_ns_ = 0;
  }
  e.is_chosen = true;
  tell_stream();
  return true;
}

// Makes a follower of the chosen stream. It was found playable, so making its timeline again cannot fail.
Result<std::unique_ptr<Follower>> ClientCore::follow(const transport::SessionMessage& session,
                                                     Now now) const {
  const transport::StreamMessage& stream = session.streams[chooser_->chosen().index];
  return ClientTimeline::create(stream.layout, {.run_blocks = options_.run_blocks})
      .map([&](ClientTimeline&& timeline) {
        timeline.set_clock(options_.measure_ns);
        return std::make_unique<Follower>(stream, std::move(timeline), session.frame_rate_hz, join_attempt(),
                                          now.steady_ns);
      });
}

void ClientCore::prefer(std::string_view preference) {
  preference_ = read_preference(preference);
  if (chooser_) chooser_->prefer(preference_);
}

void ClientCore::leave_unplayable(Now now) {
  EpochState& e = *epoch_;
  if (e.wrong_joins < kMostWrongJoins) return;
  e.unplayable.push_back(e.played->stream().id);
  auto other = choose_stream(e.session, now);
  if (!other) {
    refuse(other.error());
    port_.pass_over_session(transport::PassOver::kUntilAnnouncedAnew);
    return;
  }
  log(LogLevel::kError, kUnplayable);
  join_instead(std::move(*other), now);
}

void ClientCore::tell_stream() {
  const StreamOffer& chosen = chooser_->chosen();
  const Layout& layout = epoch_->played->stream().layout;
  log(LogLevel::kInfo,
      "stream " + chosen.name + " (" + layout.predictor + ", " + layout.codec + "): " + chooser_->reason());
  listener_.on_stream(epoch_->played->stream());
}

// A server has a status of streams that it does not offer yet.
void ClientCore::tell_if_only_measured(const transport::ServerStatusMessage& status) {
  if (preference_.kind != StreamPreference::Kind::kNamed || status.predictor != preference_.name ||
      told_measured_)
    return;
  for (const transport::StreamMessage& offered : epoch_->session.streams)
    if (offered.id.id == status.stream) return;
  told_measured_ = true;
  log(LogLevel::kInfo, "the stream that was asked for is measured, not offered");
}

void ClientCore::take_statuses(Now now) {
  EpochState& e = *epoch_;
  inbox_.statuses.clear();
  port_.take(inbox_.statuses);
  for (const auto& received : inbox_.statuses) {
    if (received.from != e.server || received.message.epoch != e.session.epoch) continue;
    e.quiet_ns = 0;
    told_ns_ = now.steady_ns;
    makes_frames_ = received.message.frame_rate_hz > 0;
    e.unproven = false;
    tell_if_only_measured(received.message);
    chooser_->on_status(received.message);
    listener_.on_server_status(received.message);
  }
}

void ClientCore::consider_streams(Now now) {
  EpochState& e = *epoch_;
  if (e.change) {
    follow_change(now);
    return;
  }
  const bool other = chooser_->reconsider(
      {.now_ns = now.steady_ns,
       .idle_since_ns = e.played->joining() ? std::optional(e.played->heard_ns()) : std::nullopt,
       .round_trip_ns = e.pacer.clock().round_trip_ns()});
  if (other) change_stream(now);
}

void ClientCore::change_stream(Now now) {
  EpochState& e = *epoch_;
  if (chooser_->chosen().id == e.played->stream().id) return;
  auto chosen = follow(e.session, now);
  if (!chosen) {
    chooser_->gave_up(now.steady_ns);
    log(LogLevel::kError, chosen.error().message);
    return;
  }
  if (e.played->joining()) {
    join_instead(std::move(*chosen), now);
    return;
  }
  log(LogLevel::kInfo, "changing to stream " + chooser_->chosen().name + ": " + chooser_->reason());
  e.change.emplace(std::move(*chosen), e.session.frame_rate_hz);
}

void ClientCore::join_instead(std::unique_ptr<Follower> other, Now now) {
  EpochState& e = *epoch_;
  e.played->close(port_);
  e.played = std::move(other);
  e.is_chosen = false;
  e.has_loaded = false;
  e.wrong_joins = 0;
  e.join_began_ns = now.steady_ns;
}

void ClientCore::follow_change(Now now) {
  EpochState& e = *epoch_;
  if (e.change->gets_nowhere(now.steady_ns, statistics_.last_applied_ns)) {
    give_up_change("nothing was received", now);
    return;
  }
  if (e.change->to().joining() && !join(e.change->to(), now)) return;
  const Follower::Step step = e.change->catch_up(*e.played, e.scheduled, [this] { return is_spent(); });
  if (step.loss) on_loss_in_change(*step.loss, now);
  if (step.done) move_over(now);
}

void ClientCore::on_loss_in_change(const Follower::Loss& loss, Now now) {
  count(loss);
  if (!epoch_->change->to().joining()) give_up_change(loss.text(), now);
}

void ClientCore::move_over(Now now) {
  EpochState& e = *epoch_;
  e.played->close(port_);
  const Frame left_at = e.played->timeline().applied();
  e.played = e.change->take();
  e.has_loaded = !e.played->joining();
  e.wrong_joins = 0;
  e.change.reset();
  e.frame_cost_ns = 0;
  e.told_too_slow = false;
  ++statistics_.stream_changes;
  ack_due_ = true;
  if (!e.played->joining()) show_other(left_at, now);
  tell_stream();
}

void ClientCore::show_other(Frame left_at, Now now) {
  EpochState& e = *epoch_;
  const ClientTimeline& timeline = e.played->timeline();
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
  log(LogLevel::kWarning, "cannot change to stream " + chooser_->chosen().name + ": " + why);
  e.change->to().close(port_);
  e.played->continue_after(e.change->to().join_attempt());
  e.change.reset();
  chooser_->gave_up(now.steady_ns);
  ack_due_ = true;
}

// Handles other streams in the same epoch: the stream that is followed goes on, if it still exists.
void ClientCore::adopt_streams(const transport::SessionMessage& session, Now now) {
  EpochState& e = *epoch_;
  const auto still = [&session](const Follower& follower) {
    return std::any_of(
        session.streams.begin(), session.streams.end(), [&](const transport::StreamMessage& stream) {
          return stream.id == follower.stream().id && stream.layout_hash == follower.stream().layout_hash;
        });
  };
  if (e.change && !still(e.change->to())) give_up_change("the server does not publish it any more", now);
  session_ = e.session = session;
  listener_.on_session(session);
  const bool goes_on = still(*e.played);
  auto chosen = choose_stream(session, now);
  if (!chosen) {
    refuse(chosen.error());
    return;
  }
  if (e.is_chosen && (e.change || goes_on)) choice_due_ns_ = 0;
  if (e.change) chooser_->keep(e.change->to().stream().id, e.played->stream().id);
  if (goes_on) {
    if (!e.change) chooser_->keep(e.played->stream().id, e.played->stream().id);
    if (e.is_chosen) listener_.on_stream(e.played->stream());
    return;
  }
  log(LogLevel::kWarning, "the server does not publish the stream that was played any more");
  if (e.change) {
    move_over(now);
    return;
  }
  join_instead(std::move(*chosen), now);
}

}  // namespace tandem::client
