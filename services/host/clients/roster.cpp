#include "services/host/clients/roster.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace tandem::host {
namespace {

using transport::Phase;
using transport::Reason;
using transport::Role;

constexpr std::int64_t kReturnNs = 10'000'000'000;   // a demoted client must keep up this long
constexpr std::int64_t kAgainNs = 300'000'000'000;   // another demotion within this time is a repeated one
constexpr std::int64_t kSilenceNs = 30'000'000'000;  // a client without an acknowledgement for so long counts
                                                     // as gone
constexpr std::int64_t kForgetNs = 60'000'000'000;   // its account is deleted after this time at the latest

}  // namespace

std::string Roster::of_stream(std::uint32_t stream) const {
  return rules_.streams.size() < 2 ? std::string() : " of stream " + rules_.streams[stream];
}

std::string client_name(transport::ClientId id) { return fmt::format("{:016x}", id); }

void Roster::note(Account& account, std::string_view what, std::int64_t now_ns) {
  notices_.add(fmt::format("client {} {}", client_name(account.id), what), account.notices, now_ns);
}

Roster::Accounts::iterator Roster::forget(Accounts::iterator account) {
  if (account->second.open) forgotten_.push_back(account->first);
  const transport::ParticipantId from = account->second.from;
  const auto next = accounts_.erase(account);
  if (std::ranges::none_of(accounts_, [&from](const auto& entry) { return entry.second.from == from; }))
    peers_.erase(from);
  return next;
}

Account* Roster::admit(const transport::AckMessage& ack, const transport::ParticipantId& from,
                       std::int64_t now_ns) {
  const auto siblings = std::ranges::count_if(
      accounts_, [&from](const auto& entry) { return entry.second.present && entry.second.from == from; });
  if (siblings >= rules_.participant_limit) return nullptr;
  if (accounts_.size() >= rules_.client_limit) {
    const auto oldest = std::ranges::min_element(accounts_, {}, [](const auto& entry) {
      return entry.second.present ? INT64_MAX : entry.second.heard_ns;
    });
    if (oldest == accounts_.end() || oldest->second.present) return nullptr;
    forget(oldest);
  }
  Account account;
  account.id = ack.client;
  account.from = from;
  account.heard_ns = now_ns;
  account.attempt = ack.join_attempt;
  if (const auto known = remembered_.find(ack.client); known != remembered_.end()) {
    account.inputs.highest = known->second.highest;
    // Told again from now on: the client may have missed the last replies of the epoch before.
    for (const transport::ReplyEntry& entry : known->second.outcomes)
      account.inputs.outcomes.add(entry, now_ns);
    remembered_.erase(known);
  }
  ++seen_;
  peers_.try_emplace(from);
  return &accounts_.emplace(ack.client, account).first->second;
}

Reason Roster::expect(const transport::AckMessage& ack, Account* account,
                      const transport::ParticipantId& from, std::int64_t now_ns) {
  if (ack.client == 0) return Reason::kInvalid;
  if (account == nullptr) account = admit(ack, from, now_ns);
  if (account == nullptr) return Reason::kFull;
  account->clock_ns = ack.clock_ns;
  account->heard_ns = now_ns;
  account->present = true;
  return Reason::kNone;
}

Reason Roster::acknowledge(const transport::AckMessage& ack, const transport::ParticipantId& from,
                           const PublishTimes& times, const Now& now) {
  const auto known = accounts_.find(ack.client);
  Account* account = known == accounts_.end() ? nullptr : &known->second;
  if (account != nullptr ? account->from != from : expects_another(ack.client, from))
    return Reason::kForeignClient;
  if (ack.protocol_version != transport::kProtocolVersion) return Reason::kProtocolVersion;
  if (ack.epoch == 0) return expect(ack, account, from, now.ns);
  if (ack.epoch != rules_.epoch) return Reason::kStaleEpoch;
  if (!lists(ack.stream)) return Reason::kNoStream;
  // The client plays its stream until it has the other's snapshot. Its `playing` may have been overwritten by
  // what it says now; so may the `playing` of `next_stream`, if the client is on its way back. One that asks
  // for the stream that it plays has no state of it, and goes on.
  const bool changes =
      account != nullptr && ack.phase == Phase::kJoining && ack.applied > 0 &&
      (ack.stream.id == account->stream && account->next_stream && *account->next_stream != account->stream
           ? was_served(*account)
           : account->phase == Phase::kPlaying || was_served(*account));
  const bool plays = ack.phase == Phase::kPlaying || changes;
  const bool readable = ack.client != 0 && (plays || ack.phase == Phase::kJoining) &&
                        (ack.role_wanted == Role::kParticipant || ack.role_wanted == Role::kObserver);
  if (!readable || (plays && ack.applied > now.frame)) return Reason::kInvalid;
  if (account == nullptr) account = admit(ack, from, now.ns);
  if (account == nullptr) return Reason::kFull;

  if (account->wanted != ack.role_wanted) account->reply.schedule.on_change();
  const bool starts_over = follow_stream(*account, ack, changes, now);
  if (plays && starts_over) {
    account->timed_from = now.frame;
    const std::int64_t frames = transport::ack_spacing(rules_.fixed_window.value_or(rules_.window_ceiling));
    if (frames > 1) account->round_trip.expect(std::min(frames * now.period_ns, transport::kAckSpacingNs));
    note(*account,
         (ack.role_wanted == Role::kParticipant ? "plays as participant" : "plays as observer") +
             of_stream(account->stream),
         now.ns);
  } else if (plays && ack.applied > account->applied && ack.applied > account->timed_from) {
    // The frame that has waited longest for this acknowledgement. Frames are not acknowledged one by one.
    if (const auto at_ns = times.of(std::max(account->applied, account->timed_from) + 1))
      account->round_trip.measured(now.ns - *at_ns);
  }
  // A joiner counts only once it has caught up again, even if its `joining` was overwritten by its `playing`.
  if (!plays || starts_over || ack.role_wanted == Role::kObserver) account->counted = false;
  account->asked = true;
  account->wanted = ack.role_wanted;
  account->applied = ack.applied;
  account->clock_ns = ack.clock_ns;
  account->reply.schedule.on_clock();
  account->heard_ns = now.ns;
  account->present = true;
  return Reason::kNone;
}

bool Roster::follow_stream(Account& account, const transport::AckMessage& ack, bool changes, const Now& now) {
  const struct {
    Phase phase = {};
    std::uint32_t stream = 0, attempt = 0;
    std::optional<std::uint32_t> next_stream;
  } before{account.phase, account.stream, account.attempt, account.next_stream};
  account.attempt = ack.join_attempt;
  account.phase = changes ? Phase::kPlaying : ack.phase;
  account.next_stream = changes ? std::optional(ack.stream.id) : std::nullopt;
  if (!changes) account.stream = ack.stream.id;
  if (changes && before.next_stream && ack.stream.id == account.stream) account.stream = *before.next_stream;
  if (account.phase != before.phase || account.stream != before.stream ||
      account.next_stream != before.next_stream)
    account.reply.schedule.on_change();
  if (account.phase != Phase::kPlaying || before.phase != Phase::kPlaying) return true;
  // The client asked for a snapshot of another stream, and now it plays that one or gave it up.
  if (before.next_stream && account.stream != before.stream && account.stream == *before.next_stream)
    note(account, "changed to stream " + rules_.streams[account.stream], now.ns);
  const bool expected = changes || before.next_stream || account.attempt == before.attempt;
  return !expected || (account.stream != before.stream && account.stream != before.next_stream);
}

// Looked up until it acts, because that takes as long as there are clients.
transport::Received<transport::AckMessage>& Roster::with_role(transport::Received<transport::AckMessage>& ack,
                                                              transport::ServerPort& port) {
  if (ack.message.role_wanted != Role::kParticipant) return ack;
  const auto known = peers_.find(ack.from);
  const bool acts = (known != peers_.end() && known->second.acts) || port.acts(ack.from);
  if (known != peers_.end()) known->second.acts = acts;
  if (!acts) ack.message.role_wanted = Role::kObserver;
  return ack;
}

Account* Roster::find(transport::ClientId id, const transport::ParticipantId& from, Reason& reason) {
  const auto known = accounts_.find(id);
  if (known == accounts_.end()) {
    reason = expects_another(id, from) ? Reason::kForeignClient : Reason::kNotPlaying;
    return nullptr;
  }
  if (known->second.from != from) {
    reason = Reason::kForeignClient;
    return nullptr;
  }
  reason = Reason::kNone;
  return &known->second;
}

// Otherwise whoever comes first under a known id would be told what its owner has to be told.
bool Roster::expects_another(transport::ClientId id, const transport::ParticipantId& from) const {
  const auto known = remembered_.find(id);
  return known != remembered_.end() && known->second.from != from;
}

void Roster::remember(const std::vector<checkpoint::ClientState>& clients) {
  for (const checkpoint::ClientState& client : clients) remembered_.emplace(client.id, client);
}

void Roster::capture(std::vector<checkpoint::ClientState>& out) const {
  out.clear();
  for (const auto& [id, account] : accounts_)
    out.push_back({id, account.from, account.inputs.highest, account.inputs.outcomes.entries()});
  for (const auto& [id, client] : remembered_)
    if (!accounts_.contains(id)) out.push_back(client);
}

void Roster::look_for_dead(transport::ServerPort& port, const Now& now) {
  if (!remembered_ns_) remembered_ns_ = now.ns;
  if (now.ns - *remembered_ns_ > kForgetNs) remembered_.clear();
  for (auto it = accounts_.begin(); it != accounts_.end();) {
    Account& account = it->second;
    const std::int64_t silence_ns = now.ns - account.heard_ns;
    if (account.present && (silence_ns > kSilenceNs || !port.alive(account.from))) {
      account.present = false;
      account.counted = false;
      note(account, "is gone", now.ns);
    }
    const bool returns = silence_ns <= kForgetNs && !port.ended(account.from);
    it = account.present || returns ? std::next(it) : forget(it);
  }
}

bool Roster::blocked(const Now& now) const {
  return std::ranges::any_of(
      accounts_, [&](const auto& entry) { return entry.second.counted && !keeps_up(entry.second, now); });
}

bool Roster::blamed(const Now& now) const {
  return std::ranges::any_of(accounts_, [&](const auto& entry) { return blamed(entry.second, now); });
}

void Roster::charge(std::int64_t duration_ns, const Now& now) {
  std::set<transport::ParticipantId> charged;  // charged once, however many of its clients are to blame
  for (auto& [id, account] : accounts_) {
    if (!blamed(account, now)) continue;
    StallMeter& stalls = peer(account).stalls;
    if (charged.insert(account.from).second) stalls.charge(now.ns, duration_ns);
    if (!rules_.stall_timeout_ns || stalls.total_ns(now.ns) <= *rules_.stall_timeout_ns) continue;
    account.demoted = true;
    account.counted = false;
    account.kept_up = false;
    account.reply.schedule.on_change();
    ++demotions_;
    if (account.demoted_at_ns && now.ns - *account.demoted_at_ns <= kAgainNs) ++repeated_demotions_;
    account.demoted_at_ns = now.ns;
    note(account, "delayed the others for too long; it is an observer until it has kept up for 10 s", now.ns);
  }
}

std::optional<std::int64_t> Roster::patience_ns(const Now& now) {
  std::optional<std::int64_t> least;
  if (!rules_.stall_timeout_ns) return least;
  for (auto& [id, account] : accounts_) {
    if (!blamed(account, now)) continue;
    const std::int64_t left =
        std::max<std::int64_t>(*rules_.stall_timeout_ns - peer(account).stalls.total_ns(now.ns), 0);
    least = std::min(least.value_or(left), left);
  }
  return least;
}

void Roster::frame_starts(const Now& now) {
  for (auto& [id, account] : accounts_) {
    if (account.demoted && !keeps_up(account, now)) account.kept_up = false;
  }
}

void Roster::refresh(const Now& now) {
  std::int64_t round_trip_ns = 0;
  for (auto& [id, account] : accounts_) {
    if (account.plays() && account.wanted == Role::kParticipant) {
      round_trip_ns = std::max(round_trip_ns, account.round_trip.high_ns());
    }
  }
  if (!rules_.fixed_window) window_ = window_for(round_trip_ns, now.period_ns, rules_.window_ceiling);

  for (auto& [id, account] : accounts_) {
    const bool abreast = account.plays() && keeps_up(account, now);
    if (account.demoted) {
      if (abreast && !account.kept_up) account.kept_up_since_ns = now.ns;
      account.kept_up = account.plays() && (account.kept_up || abreast);
      if (account.kept_up && abreast && now.ns - account.kept_up_since_ns >= kReturnNs) {
        account.demoted = false;
        account.reply.schedule.on_change();
        note(account, "has kept up for 10 s and is a participant again", now.ns);
      }
    }
    if (abreast && account.role() == Role::kParticipant) account.counted = true;
  }
}

std::uint32_t Roster::counted() const {
  return static_cast<std::uint32_t>(
      std::ranges::count_if(accounts_, [](const auto& entry) { return entry.second.counted; }));
}

std::uint32_t Roster::counted(std::uint32_t stream) const {
  return static_cast<std::uint32_t>(std::ranges::count_if(accounts_, [stream](const auto& entry) {
    return entry.second.counted && entry.second.stream == stream;
  }));
}

std::uint32_t Roster::watching() const {
  return static_cast<std::uint32_t>(std::ranges::count_if(
      accounts_, [](const auto& entry) { return entry.second.plays() && !entry.second.counted; }));
}

std::uint32_t Roster::watching(std::uint32_t stream) const {
  return static_cast<std::uint32_t>(std::ranges::count_if(accounts_, [stream](const auto& entry) {
    return entry.second.plays() && !entry.second.counted && entry.second.stream == stream;
  }));
}

}  // namespace tandem::host
