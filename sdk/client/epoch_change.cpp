// Chooses the stream that is played, and changes to another one: idl/STATES.md, "Changing the stream".
#include <algorithm>
#include <utility>

#include "sdk/client/followed_epoch.hpp"
#include "sdk/client/session/session_check.hpp"

namespace tandem::client {

namespace {
constexpr std::string_view kUnplayable =
    "this client computes the stream differently from the server: the state soon differed after each of "
    "several snapshots";
// A server tells once a second what each of its streams takes.
constexpr std::int64_t kStatusPatienceNs = 1200 * kMillisecond;
// Of a stream that it does not make, every five seconds.
constexpr std::int64_t kCapPatienceNs = 6 * kSecond;
}  // namespace

Result<std::unique_ptr<FollowedEpoch>> FollowedEpoch::begin(
    const transport::Received<transport::SessionMessage>& announced, Lasting& client, bool unproven,
    Now now) {
  auto chooser = choose(announced.message, {}, client);
  if (!chooser) return tl::unexpected<Error>(chooser.error());
  auto first = follow(announced.message, *chooser, client, client.join_attempts, now);
  if (!first) return tl::unexpected<Error>(first.error());
  std::unique_ptr<FollowedEpoch> epoch(
      new FollowedEpoch(announced, client, unproven, std::move(*chooser), std::move(*first), now));
  epoch->choice_due_ns_ = now.steady_ns + kStatusPatienceNs;
  return Result<std::unique_ptr<FollowedEpoch>>(std::move(epoch));
}

Result<StreamChooser> FollowedEpoch::choose(const transport::SessionMessage& session,
                                            const std::vector<StreamId>& unplayable, Lasting& client) {
  auto playable = playable_streams(session);
  if (!playable) return tl::unexpected<Error>(playable.error());
  std::erase_if(*playable, [&](std::size_t index) {
    return std::count(unplayable.begin(), unplayable.end(), session.streams[index].id) > 0;
  });
  if (playable->empty()) return fail(ErrorCode::kMismatch, std::string(kUnplayable));
  std::vector<StreamOffer> offers = list_offers(session, *playable, client.options.delay_ms());
  const auto suiting = std::count_if(offers.begin(), offers.end(),
                                     [](const StreamOffer& offer) { return !offer.suits_others; });
  const bool choice = suiting > 1 && client.preference.kind != StreamPreference::Kind::kNamed;
  if (choice && !client.own_step_ns) client.own_step_ns = measure_own_step(client.options.measure_ns);
  return StreamChooser(std::move(offers), client.preference, 1e9 / session.frame_rate_hz, client.own_step_ns,
                       client.options.gateway_caps ? 0 : client.options.cap_kbit_s);
}

Result<std::unique_ptr<Follower>> FollowedEpoch::follow(const transport::SessionMessage& session,
                                                        const StreamChooser& chooser, const Lasting& client,
                                                        std::uint32_t join_attempts, Now now) {
  const transport::StreamMessage& stream = session.streams[chooser.chosen().index];
  return ClientTimeline::create(stream.layout, {.run_blocks = client.options.run_blocks})
      .map([&](ClientTimeline&& timeline) {
        timeline.set_clock(client.options.measure_ns);
        return std::make_unique<Follower>(stream, std::move(timeline), session.frame_rate_hz, join_attempts,
                                          now.steady_ns);
      });
}

Result<std::unique_ptr<Follower>> FollowedEpoch::choose_anew(Now now) {
  auto chooser = choose(session_, unplayable_, client_);
  if (!chooser) return tl::unexpected<Error>(chooser.error());
  chooser_ = std::move(*chooser);
  choice_due_ns_ = now.steady_ns + kStatusPatienceNs;
  return follow_chosen(now);
}

Result<std::unique_ptr<Follower>> FollowedEpoch::follow_chosen(Now now) const {
  return follow(session_, chooser_, client_, join_attempt(), now);
}

bool FollowedEpoch::settle_choice(Now now) {
  TANDEM_ASSERT(!is_told_ && played().joining());
  if (choice_due_ns_) {
    if (now.steady_ns < *choice_due_ns_ && chooser_.wants_status()) return false;
    chooser_.choose_anew();
    if (const auto needed = chooser_.needed_kbit_s()) {
      const bool waits = chooser_.wants_status() && now.steady_ns < *choice_due_ns_ + kCapPatienceNs;
      if (!waits) refuse_for_cap(*needed);
      return false;
    }
    if (chooser_.chosen().id != stream().id) {
      auto chosen = follow_chosen(now);
      if (!chosen) {
        client_.log(LogLevel::kError, chosen.error().message);
        return false;
      }
      played_ = std::move(*chosen);
    }
    choice_due_ns_.reset();
  }
  is_told_ = true;
  tell_stream();
  return true;
}

void FollowedEpoch::refuse_for_cap(std::uint32_t needed_kbit_s) {
  const std::string needed =
      needed_kbit_s > 0 ? std::to_string(needed_kbit_s) : std::string("an unknown number of");
  refusal_ = Error{ErrorCode::kUnsupported, "the session takes more than this client's cap: it needs " +
                                                needed + " kbit/s on the network, and the cap is " +
                                                std::to_string(client_.options.cap_kbit_s)};
}

Result<void> FollowedEpoch::leave_unplayable(Now now) {
  if (refusal_) return tl::unexpected<Error>(*refusal_);
  if (wrong_joins_ < kMaxWrongJoins) return {};
  unplayable_.push_back(stream().id);
  auto other = choose_anew(now);
  if (!other) return tl::unexpected<Error>(other.error());
  client_.log(LogLevel::kError, kUnplayable);
  join_instead(std::move(*other), now);
  return {};
}

void FollowedEpoch::tell_stream() {
  const Layout& layout = stream().layout;
  client_.log(LogLevel::kInfo, "stream " + chooser_.chosen().name + " (" + layout.predictor + ", " +
                                   layout.codec + "): " + chooser_.reason());
  client_.listener.on_stream(stream());
}

void FollowedEpoch::consider_streams(Now now) {
  if (change_) {
    follow_change(now);
    return;
  }
  const bool other = chooser_.reconsider(
      {.now_ns = now.steady_ns,
       .idle_since_ns = played().joining() ? std::optional(played().heard_ns()) : std::nullopt,
       .round_trip_ns = clock().round_trip_ns(),
       .wire_bytes = client_.statistics.wire_bytes});
  if (other) change_stream(now);
  if (!is_told_) return;
  if (const auto needed = chooser_.needed_kbit_s()) refuse_for_cap(*needed);
}

void FollowedEpoch::change_stream(Now now) {
  TANDEM_ASSERT(!change_);
  if (chooser_.chosen().id == stream().id) return;
  auto chosen = follow_chosen(now);
  if (!chosen) {
    chooser_.gave_up(now.steady_ns);
    client_.log(LogLevel::kError, chosen.error().message);
    return;
  }
  if (played().joining()) {
    join_instead(std::move(*chosen), now);
    return;
  }
  client_.log(LogLevel::kInfo, "changing to stream " + chooser_.chosen().name + ": " + chooser_.reason());
  change_.emplace(std::move(*chosen), session_.frame_rate_hz);
}

void FollowedEpoch::join_instead(std::unique_ptr<Follower> other, Now now) {
  TANDEM_ASSERT(!change_ && other->joining());
  played().close(client_.port);
  played_ = std::move(other);
  is_told_ = false;
  has_loaded_ = false;
  wrong_joins_ = 0;
  join_began_ns_ = now.steady_ns;
}

void FollowedEpoch::follow_change(Now now) {
  TANDEM_ASSERT(change_ && !played().joining());
  if (change_->gets_nowhere(now.steady_ns, client_.statistics.last_applied_ns)) {
    give_up_change("nothing was received", now);
    return;
  }
  if (change_->to().joining() && !join(change_->to(), now)) return;
  const Follower::Step step = change_->catch_up(played(), scheduled_, [this](const ClientTimeline& other) {
    client_.news.keep(other);
    return client_.is_spent();
  });
  if (step.loss) on_loss_in_change(*step.loss, now);
  if (step.done) move_over(now);
}

void FollowedEpoch::on_loss_in_change(const Follower::Loss& loss, Now now) {
  TANDEM_ASSERT(change_.has_value());
  count(loss);
  if (!change_->to().joining()) give_up_change(loss.text(), now);
}

void FollowedEpoch::move_over(Now now) {
  TANDEM_ASSERT(change_.has_value());
  played().close(client_.port);
  const Frame left_at = played().timeline().applied();
  played_ = change_->take();
  has_loaded_ = !played().joining();
  wrong_joins_ = 0;
  change_.reset();
  frame_cost_ns_ = 0;
  told_too_slow_ = false;
  pace();
  ++client_.statistics.stream_changes;
  client_.ack_due = true;
  if (!played().joining()) show_other(left_at, now);
  tell_stream();
  if (!played().joining()) client_.news.move_over(played().timeline());
  client_.news.forget_kept();
}

void FollowedEpoch::show_other(Frame left_at, Now now) {
  const ClientTimeline& timeline = played().timeline();
  follow_uncorrected();
  simulate_ahead(now);
  if (timeline.applied() == left_at) {
    pictures_.on_changed(timeline, pacer_, now.steady_ns);
  } else if (client_.pictures.wanted()) {
    pictures_.on_loaded(timeline, pacer_, now.steady_ns);
  }
  client_.sent.on_applied(timeline.applied(), now.steady_ns, client_.outcomes);
}

void FollowedEpoch::give_up_change(const std::string& why, Now now) {
  TANDEM_ASSERT(change_.has_value());
  client_.log(LogLevel::kWarning, "cannot change to stream " + chooser_.chosen().name + ": " + why);
  client_.news.forget_kept();
  change_->to().close(client_.port);
  played().continue_after(change_->to().join_attempt());
  change_.reset();
  chooser_.gave_up(now.steady_ns);
  client_.ack_due = true;
}

Result<void> FollowedEpoch::adopt_streams(const transport::SessionMessage& session, Now now) {
  TANDEM_ASSERT(session.epoch == session_.epoch);
  const auto still = [&session](const Follower& follower) {
    return std::any_of(
        session.streams.begin(), session.streams.end(), [&](const transport::StreamMessage& stream) {
          return stream.id == follower.stream().id && stream.layout_hash == follower.stream().layout_hash;
        });
  };
  if (change_ && !still(change_->to())) give_up_change("the server does not publish it any more", now);
  session_ = session;
  lead_ = std::min(client_.options.lead, session_.lead);
  client_.listener.on_session(session);
  const bool goes_on = still(played());
  auto chosen = choose_anew(now);
  if (!chosen) return tl::unexpected<Error>(chosen.error());
  if (is_told_ && (change_ || goes_on)) choice_due_ns_.reset();
  if (change_) chooser_.keep(change_->to().stream().id, stream().id);
  if (goes_on) {
    if (!change_) chooser_.keep(stream().id, stream().id);
    if (is_told_) client_.listener.on_stream(stream());
    return {};
  }
  client_.log(LogLevel::kWarning, "the server does not publish the stream that was played any more");
  if (change_) {
    move_over(now);
  } else {
    join_instead(std::move(*chosen), now);
  }
  return {};
}

}  // namespace tandem::client
