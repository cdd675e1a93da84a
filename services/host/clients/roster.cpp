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

Standing standing_of(const Account* account) {
  if (account == nullptr) return Standing::kUnknown;
  const bool served = was_served(*account);
  if (account->phase != Phase::kPlaying) return served ? Standing::kServed : Standing::kJoining;
  if (!account->next_stream) return Standing::kPlaying;
  if (*account->next_stream == account->stream) return Standing::kFetching;
  return served ? Standing::kChangingServed : Standing::kChanging;
}

Said said_by(const transport::AckMessage& ack, const Account* account) {
  if (ack.phase == Phase::kJoining) return ack.applied > 0 ? Said::kChanges : Said::kJoins;
  return account != nullptr && account->attempt == ack.join_attempt ? Said::kPlays : Said::kPlaysAnew;
}

Named named_by(const transport::AckMessage& ack, const Account* account) {
  if (account == nullptr) return Named::kOther;
  if (ack.stream.id == account->stream) return Named::kOwn;
  return account->next_stream == ack.stream.id ? Named::kNext : Named::kOther;
}

}  // namespace

std::string Roster::of_stream(std::uint32_t stream) const {
  return rules_.streams.size() < 2 ? std::string() : " of stream " + rules_.streams[stream];
}

std::string client_name(transport::ClientId id) { return fmt::format("{:016x}", id); }

void Roster::note(Account& account, std::string_view what, std::int64_t now_ns) {
  notices_.add(fmt::format("client {} {}", client_name(account.id), what), account.notices, now_ns);
}

Roster::Accounts::iterator Roster::forget(Accounts::iterator account) {
  TANDEM_ASSERT(!account->second.present);
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
  TANDEM_ASSERT(!accounts_.contains(ack.client));
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
                           const Now& now) {
  const auto known = accounts_.find(ack.client);
  Account* account = known == accounts_.end() ? nullptr : &known->second;
  if (account != nullptr ? account->from != from : expects_another(ack.client, from))
    return Reason::kForeignClient;
  if (ack.protocol_version != transport::kProtocolVersion) return Reason::kProtocolVersion;
  if (ack.epoch == 0) return expect(ack, account, from, now.ns);
  if (ack.epoch != rules_.epoch) return Reason::kStaleEpoch;
  if (!lists(ack.stream)) return Reason::kNoStream;
  if (!fits(ack)) return Reason::kCap;
  const bool readable = ack.client != 0 && (ack.phase == Phase::kPlaying || ack.phase == Phase::kJoining) &&
                        (ack.role_wanted == Role::kParticipant || ack.role_wanted == Role::kObserver);
  if (!readable) return Reason::kInvalid;
  const Action action = action_of(standing_of(account), said_by(ack, account), named_by(ack, account));
  if (plays(action) && ack.applied > now.frame) return Reason::kInvalid;
  if (account == nullptr) account = admit(ack, from, now.ns);
  if (account == nullptr) return Reason::kFull;

  if (account->wanted != ack.role_wanted) account->reply.schedule.on_change();
  follow_stream(*account, ack, action, now);
  if (enters(action)) {
    account->timed_from = now.frame;
    const std::int64_t frames = transport::ack_spacing(rules_.fixed_window.value_or(rules_.window_ceiling));
    if (frames > 1) account->round_trip.expect(std::min(frames * now.period_ns, transport::kAckSpacingNs));
    note(*account,
         (ack.role_wanted == Role::kParticipant ? "plays as participant" : "plays as observer") +
             of_stream(account->stream),
         now.ns);
  } else if (plays(action) && ack.applied > account->applied && ack.applied > account->timed_from) {
    // The delta that has waited longest for this acknowledgement. Deltas are not acknowledged one by one.
    const Frame before = std::max(account->applied, account->timed_from);
    if (const auto sent = sent_to(*account, now).first_beyond(before))
      account->round_trip.measured(now.ns - sent->at_ns);
  }
  // A joiner counts only once it has caught up again, even if its `joining` was overwritten by its `playing`.
  if (!plays(action) || enters(action) || ack.role_wanted == Role::kObserver) account->counted = false;
  account->asked = true;
  account->cap_kbit_s = ack.cap_kbit_s;
  account->wanted = ack.role_wanted;
  account->applied = ack.applied;
  account->clock_ns = ack.clock_ns;
  account->reply.schedule.on_clock();
  account->heard_ns = now.ns;
  account->present = true;
  return Reason::kNone;
}

void Roster::follow_stream(Account& account, const transport::AckMessage& ack, Action action,
                           const Now& now) {
  const Phase phase_before = account.phase;
  const std::uint32_t stream_before = account.stream;
  const std::optional<std::uint32_t> next_before = account.next_stream;
  TANDEM_ASSERT(!moves(action) || next_before.has_value());
  account.attempt = ack.join_attempt;
  account.phase = plays(action) ? Phase::kPlaying : Phase::kJoining;
  if (action == Action::kJoin || action == Action::kEnter) account.stream = ack.stream.id;
  if (moves(action)) account.stream = *next_before;
  account.next_stream = changes(action) ? std::optional(ack.stream.id) : std::nullopt;
  if (account.phase != phase_before || account.stream != stream_before || account.next_stream != next_before)
    account.reply.schedule.on_change();
  if (moves(action)) note(account, "changed to stream " + rules_.streams[account.stream], now.ns);
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
    TANDEM_ASSERT(!account.demoted);  // nobody waits for one that is
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

std::uint32_t Roster::counted(std::optional<std::uint32_t> stream) const {
  return static_cast<std::uint32_t>(std::ranges::count_if(accounts_, [stream](const auto& entry) {
    return entry.second.counted && entry.second.stream == stream.value_or(entry.second.stream);
  }));
}

std::uint32_t Roster::watching(std::optional<std::uint32_t> stream) const {
  return static_cast<std::uint32_t>(std::ranges::count_if(accounts_, [stream](const auto& entry) {
    const Account& account = entry.second;
    return account.plays() && !account.counted && account.stream == stream.value_or(account.stream);
  }));
}

}  // namespace tandem::host
