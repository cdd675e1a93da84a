#pragma once
// The clients of a session: their ids, whether the server waits for them, and what they have cost.

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/port.hpp"
#include "services/host/accounts/limits.hpp"
#include "services/host/accounts/outcomes.hpp"
#include "services/host/accounts/reply_schedule.hpp"
#include "services/host/checkpoint/checkpoint.hpp"
#include "services/host/clients/notices.hpp"
#include "services/host/clients/stall_meter.hpp"
#include "services/host/clients/standing.hpp"
#include "services/host/clients/window.hpp"
#include "services/host/outgoing/sent_frames.hpp"
#include "services/program/budget.hpp"
#include "services/program/token_bucket.hpp"

namespace tandem::host {

/// The last outcomes of a client's inputs, and its rate limit.
struct InputAccount {
  std::uint64_t highest = 0;                  ///< highest input number that was taken, whatever the outcome
  std::vector<std::uint64_t> undecided = {};  ///< those without an outcome yet; ascending
  accounts::Outcomes outcomes;
  accounts::TokenBucket rate = accounts::kInputs;

  /// All inputs up to this number have their outcome.
  [[nodiscard]] std::uint64_t decided() const {
    TANDEM_ASSERT(undecided.empty() || (undecided.front() > 0 && undecided.back() <= highest));
    return undecided.empty() ? highest : undecided.front() - 1;
  }
};

struct JoinAccount {
  bool served = false;
  std::uint32_t served_attempt = 0;
  std::uint32_t served_stream = 0;
};

struct ReplyAccount {
  accounts::ReplySchedule schedule;
  transport::Reason once = transport::Reason::kNone;  ///< sent only with the next reply
  std::uint32_t needed_kbit_s = 0;                    ///< the same
};

/// The account of one client id. It survives rejoins. It is forgotten with its DDS participant, or a minute
/// after the last message of the client.
struct Account {
  transport::ClientId id = 0;
  transport::ParticipantId from;
  transport::Phase phase = transport::Phase::kJoining;
  std::uint32_t cap_kbit_s = 0;  ///< 0: none
  transport::Role wanted = transport::Role::kObserver;
  std::uint32_t stream = 0;                  ///< the stream that it plays or joins
  std::optional<std::uint32_t> next_stream;  ///< the stream that it joins while it plays `stream`
  bool open = false;                         ///< the client has writers of its own
  bool asked = false;                        ///< it asked to join this session; false: it only looks for it
  bool present = true;                       ///< its participant is alive and it was heard lately
  bool counted = false;  ///< a participant that plays and has caught up: the server waits for it
  bool demoted = false;
  bool kept_up = false;  ///< while demoted: it has kept up since kept_up_since_ns
  std::int64_t kept_up_since_ns = 0;
  std::optional<std::int64_t> demoted_at_ns;  ///< the last time
  Frame applied = 0;
  Frame timed_from = 0;  ///< round trips are measured on frames after this one
  std::uint32_t attempt = 0;
  std::int64_t clock_ns = 0;
  std::int64_t heard_ns = 0;
  RoundTrip round_trip;
  InputAccount inputs;
  JoinAccount join;
  ReplyAccount reply;
  accounts::TokenBucket notices = kNoticesOfClient;

  [[nodiscard]] transport::Role role() const { return demoted ? transport::Role::kObserver : wanted; }
  [[nodiscard]] bool plays() const { return present && phase == transport::Phase::kPlaying; }
};

/// Limits of one DDS participant, for all its clients together; otherwise more ids would mean more cost.
struct Peer {
  StallMeter stalls;
  accounts::Budget inputs;                                            ///< see engine::InputBudget
  accounts::TokenBucket snapshots_again = accounts::kSnapshotsAgain;  ///< snapshots after the first one of
                                                                      ///< each account
  bool acts = false;                                                  ///< it had a writer of inputs
};

/// The stream that the client is joining, from outside or from another stream.
[[nodiscard]] inline std::optional<std::uint32_t> joined_stream(const Account& account) {
  if (!account.present) return std::nullopt;
  if (account.phase == transport::Phase::kJoining)
    return account.asked ? std::optional(account.stream) : std::nullopt;
  return account.next_stream;
}

/// True if the client was served a snapshot since it last asked, and of the stream that it asked for.
[[nodiscard]] inline bool was_served(const Account& account) {
  return account.join.served && account.join.served_attempt == account.attempt &&
         account.join.served_stream == account.next_stream.value_or(account.stream);
}

/// True if the client applies the stream's deltas, or will apply them when it has the snapshot that was made
/// for it.
[[nodiscard]] inline bool needs(const Account& account, std::uint32_t stream) {
  if (!account.present) return false;
  if (account.phase == transport::Phase::kPlaying && account.stream == stream) return true;
  return joined_stream(account) == stream && was_served(account);
}

/// The rules for clients, without I/O. Not thread-safe.
class Roster {
 public:
  struct Rules {
    Epoch epoch = 0;
    std::vector<std::string> streams = {""};       ///< names by id; all have generation 0
    std::vector<std::uint32_t> caps_kbit_s = {0};  ///< by id; 0: none
    std::uint32_t client_limit = 256;
    std::uint32_t participant_limit = 16;  ///< clients of one DDS participant
    std::optional<std::int64_t> stall_timeout_ns;
    std::optional<std::uint32_t> fixed_window;
    std::uint32_t window_ceiling = 24;
  };
  explicit Roster(Rules rules)
      : rules_(std::move(rules)), window_(rules_.fixed_window.value_or(kSmallestWindow)) {
    rules_.caps_kbit_s.resize(rules_.streams.size());
  }

  /// Changes limits while clients play. Nobody is sent away: a lower limit of clients holds for those that
  /// come, and a stall timeout for stalls from now on.
  void set_limits(std::uint32_t client_limit, std::optional<std::int64_t> stall_timeout_ns) {
    rules_.client_limit = client_limit;
    rules_.stall_timeout_ns = stall_timeout_ns;
  }

  /// The state of the server when something happens.
  struct Now {
    std::int64_t ns = 0;
    Frame frame = 0;    ///< frame of the last delta made; frame s is the next
    Frame written = 0;  ///< last delta that left the queue; clients are not blamed for lacking a later one
    std::int64_t period_ns = 0;
    std::span<const SentFrames> sent = {};  ///< by stream
    std::uint32_t unsent = 0;               ///< deltas up to `frame` that are still being made
  };

  /// Handles an acknowledgement. Returns kNone if it was taken, otherwise the reason. A refused
  /// acknowledgement leaves a known account as it was.
  transport::Reason acknowledge(const transport::AckMessage& ack, const transport::ParticipantId& from,
                                const Now& now);
  /// Makes it an observer's, if its participant cannot send inputs. Otherwise who may only watch could make
  /// all wait for it.
  transport::Received<transport::AckMessage>& with_role(transport::Received<transport::AckMessage>& ack,
                                                        transport::ServerPort& port);
  /// The account of `id` if it belongs to `from`; otherwise null, and `reason` is kForeignClient or
  /// kNotPlaying.
  Account* find(transport::ClientId id, const transport::ParticipantId& from, transport::Reason& reason);

  /// Remembers what clients were told of their inputs in the epoch that this one continues. An account that
  /// such a client opens here goes on from there. As long as they are remembered, nobody else can open it.
  void remember(const std::vector<checkpoint::ClientState>& clients);
  /// Copies what clients were told of their inputs, including those that have not come back yet.
  void capture(std::vector<checkpoint::ClientState>& out) const;

  /// Forgets clients whose participant is gone. Call it now and then, and while suspended.
  void look_for_dead(transport::ServerPort& port, const Now& now);
  /// True if a client keeps the server from starting frame s = now.frame + 1.
  [[nodiscard]] bool blocked(const Now& now) const;
  /// True if a client is to blame for that: it lacks a delta that was written.
  [[nodiscard]] bool blamed(const Now& now) const;
  /// Charges a suspension of `duration_ns` to the DDS participants of all clients that are to blame. Demotes
  /// those clients whose participant has caused too much.
  void charge(std::int64_t duration_ns, const Now& now);
  /// Minimum time until a client that is to blame has used up its allowance; empty if there is no such client
  /// or no limit.
  [[nodiscard]] std::optional<std::int64_t> patience_ns(const Now& now);
  /// Frame s = now.frame + 1 starts. Notes which demoted clients do not keep up.
  void frame_starts(const Now& now);
  /// Makes demoted clients that kept up for 10 s participants again, counts joiners that have caught up, and
  /// updates the window.
  void refresh(const Now& now);

  [[nodiscard]] std::uint32_t window() const { return window_; }
  [[nodiscard]] std::uint32_t counted(std::optional<std::uint32_t> stream = {}) const;
  /// Clients that play and are not counted.
  [[nodiscard]] std::uint32_t watching(std::optional<std::uint32_t> stream = {}) const;
  [[nodiscard]] std::map<transport::ClientId, Account>& accounts() { return accounts_; }
  [[nodiscard]] Peer& peer(const Account& account) {
    const auto known = peers_.find(account.from);
    TANDEM_ASSERT(known != peers_.end());  // each participant with an account has one
    return known->second;
  }
  [[nodiscard]] std::uint64_t seen() const { return seen_; }
  [[nodiscard]] std::uint64_t demotions() const { return demotions_; }
  /// Demotions of clients that had been demoted in the five minutes before.
  [[nodiscard]] std::uint64_t repeated_demotions() const { return repeated_demotions_; }
  [[nodiscard]] const std::map<transport::ClientId, Account>& accounts() const { return accounts_; }
  /// DDS participants that have an account.
  [[nodiscard]] std::size_t peers() const { return peers_.size(); }
  [[nodiscard]] Notices& notices() { return notices_; }
  /// Forgotten accounts that have writers of their own. The caller ends their writers and removes them here.
  [[nodiscard]] std::vector<transport::ClientId>& forgotten() { return forgotten_; }

 private:
  /// Handles a client that looks for a session: its writers are made before it asks for anything.
  transport::Reason expect(const transport::AckMessage& ack, Account* account,
                           const transport::ParticipantId& from, std::int64_t now_ns);
  Account* admit(const transport::AckMessage& ack, const transport::ParticipantId& from, std::int64_t now_ns);
  /// The epoch before this one knew the id, of another DDS participant.
  [[nodiscard]] bool expects_another(transport::ClientId id, const transport::ParticipantId& from) const;
  using Accounts = std::map<transport::ClientId, Account>;
  [[nodiscard]] bool lists(const StreamId& stream) const {
    return stream.id < rules_.streams.size() && stream.generation == 0;
  }
  /// What the stream is kept within is within the client's cap, too.
  [[nodiscard]] bool fits(const transport::AckMessage& ack) const {
    return ack.cap_kbit_s == 0 ||
           (transport::is_cap(ack.cap_kbit_s) && rules_.caps_kbit_s[ack.stream.id] <= ack.cap_kbit_s);
  }
  /// Updates which stream the client plays and joins.
  void follow_stream(Account& account, const transport::AckMessage& ack, Action action, const Now& now);
  /// Returns " of stream NAME"; empty if the session has only one stream.
  [[nodiscard]] std::string of_stream(std::uint32_t stream) const;
  void note(Account& account, std::string_view what, std::int64_t now_ns);
  Accounts::iterator forget(Accounts::iterator account);
  [[nodiscard]] static const SentFrames& sent_to(const Account& account, const Now& now) {
    TANDEM_ASSERT(account.stream < now.sent.size());
    return now.sent[account.stream];
  }
  // Quiet frames that no delta tells yet are not waited for.
  [[nodiscard]] bool keeps_up(const Account& account, const Now& now) const {
    return sent_to(account, now).beyond(account.applied) + now.unsent < window_;
  }
  // While the server waits, a live client that lacks nothing says so. Silent clients are blamed together, so
  // that the server need not wait for one after the other.
  [[nodiscard]] static bool silent(const Account& account, const Now& now) {
    return now.ns - account.heard_ns > transport::kAckSpacingNs + account.round_trip.high_ns();
  }
  [[nodiscard]] bool blamed(const Account& account, const Now& now) const {
    if (!account.counted) return false;
    const auto lacks = sent_to(account, now).first_beyond(account.applied);
    return lacks && lacks->frame <= now.written && (!keeps_up(account, now) || silent(account, now));
  }

  Rules rules_;
  std::uint32_t window_;
  std::map<transport::ClientId, Account>
      accounts_;  // ordered, so that rules apply in the same order everywhere
  std::map<transport::ParticipantId, Peer> peers_;  // participants that have an account
  // Clients of the epoch before that have not come back, for as long as an account is kept.
  std::map<transport::ClientId, checkpoint::ClientState> remembered_;
  std::optional<std::int64_t> remembered_ns_;  // since when
  std::uint64_t seen_ = 0, demotions_ = 0, repeated_demotions_ = 0;
  Notices notices_;
  std::vector<transport::ClientId> forgotten_;
};

/// Sixteen hex digits: the form in which ids are shown everywhere.
[[nodiscard]] std::string client_name(transport::ClientId id);

}  // namespace tandem::host
