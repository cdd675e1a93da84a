#include "services/host/standby/standby.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "services/host/checkpoint/format.hpp"

namespace tandem::standby {
namespace {

constexpr std::int64_t kLongestWakeNs = 50 * kMillisecond;
constexpr std::int64_t kLookNs = 50 * kMillisecond;
constexpr std::int64_t kTellNs = kSecond / 4;
constexpr std::int64_t kTellSoonNs = 20 * kMillisecond;  // while something arrives
constexpr std::int64_t kRefusedNs = 10 * kSecond;        // between two lines about refused checkpoints
constexpr std::int64_t kTwinNs = 600 * kSecond;          // between two lines about who imitates the server
// A live server sends an entry of its journal within a quarter of a second after it heard of this one.
constexpr std::int64_t kProofNs = 3 * kSecond;

std::size_t size_of(const transport::JournalMessage& entry) {
  std::size_t size = sizeof entry;
  for (const transport::InputDecision& decision : entry.decisions)
    size += sizeof decision + decision.values.size() * sizeof(double) + decision.bytes.size();
  return size;
}

// More servers than this do not stand by, whatever is announced.
constexpr std::uint32_t kMaxBefore = 8;

}  // namespace

void Standby::Journal::add(transport::JournalMessage&& entry, transport::ClientId self, std::uint64_t held) {
  if (!entries.empty() && entry.number <= entries.back().number) return;
  if (entries.size() >= kMaxEntries || bytes >= kMaxJournalBytes) return;
  ended = entry.state == transport::JournalState::kLast;
  handed_over = ended && entry.successor == self;
  if (entry.number <= held) return;
  bytes += size_of(entry);
  entries.push_back(std::move(entry));
}

void Standby::Journal::forget_to(std::uint64_t number) {
  while (!entries.empty() && entries.front().number <= number) {
    TANDEM_ASSERT(size_of(entries.front()) <= bytes);
    bytes -= size_of(entries.front());
    entries.pop_front();
  }
  TANDEM_ASSERT(!entries.empty() || bytes == 0);
}

Standby::Standby(StandbyOptions options, transport::ServerPort& port, Accept accept, Follows follows)
    : options_(std::move(options)), port_(&port), accept_(std::move(accept)), follows_(std::move(follows)) {}

Result<std::unique_ptr<Standby>> Standby::create(StandbyOptions options, transport::ServerPort& port,
                                                 Accept accept, Follows follows) {
  if (auto followed = port.follow(options.id); !followed) return tl::unexpected(followed.error());
  return std::unique_ptr<Standby>(
      new Standby(std::move(options), port, std::move(accept), std::move(follows)));
}

bool Standby::poll(std::int64_t now_ns) {
  if (started_ns_ == 0) started_ns_ = newest_ns_ = now_ns;
  if (now_ns - looked_ns_ >= kLookNs || due_since_ns_) look_around(now_ns);
  silence_.pass(now_ns);
  port_->show_life();
  take_journal();
  take_checkpoints(now_ns);
  take_acknowledgements();
  note_if_slow(now_ns);
  if (now_ns - told_ns_ >= kTellNs || (news_ && now_ns - told_ns_ >= kTellSoonNs)) tell(now_ns);
  if (now_ns - status_ns_ >= kSecond) publish_status(now_ns);
  wake_ns_ = now_ns + (news_ ? kTellSoonNs : kLongestWakeNs);
  return is_time(now_ns);
}

bool Standby::from_live(Epoch epoch, const transport::ParticipantId& from) const {
  return live_ && live_->message.epoch == epoch && live_->from == from;
}

void Standby::look_around(std::int64_t now_ns) {
  looked_ns_ = now_ns;
  servers_.clear();
  port_->take_sessions(servers_);
  live_is_there_ = false;
  before_us_ = 0;
  const Announcement* other = nullptr;
  const Announcement* next = nullptr;
  const Announcement* twin = nullptr;
  const auto place = std::pair(options_.rank, port_->self());
  for (const Announcement& server : servers_) {
    if (server.from == port_->self()) continue;
    if (server.message.server_role == transport::ServerRole::kStandby) {
      if (std::pair(server.message.standby_rank, server.from) < place) ++before_us_;
    } else if (from_live(server.message.epoch, server.from)) {
      live_is_there_ = true;
      live_->message = server.message;
    } else if (live_ && server.message.epoch == live_->message.epoch) {
      twin = &server;
    } else if (live_ && server.message.continues_epoch == live_->message.epoch) {
      next = &server;
    } else if (other == nullptr || server.message.epoch > other->message.epoch) {
      other = &server;
    }
  }
  before_us_ = std::min(before_us_, kMaxBefore);
  // One that took over is followed, even if the one before is still there.
  if (next == nullptr && !live_is_there_) next = other;
  if (next == nullptr && twin != nullptr) next = choose_of_twins(*twin, now_ns);
  if (next != nullptr) {
    follow(*next);
    live_is_there_ = true;
  }
  if (checkpoint_ != nullptr && live_) announce();
}

// Two participants announce the epoch that is followed: the one that sends is the server. The other one takes
// nobody's place, not even that of a server that is gone.
const Standby::Announcement* Standby::choose_of_twins(const Announcement& twin, std::int64_t now_ns) {
  if (!heard_live_) return now_ns - followed_ns_ >= kProofNs ? &twin : nullptr;
  if (now_ns - told_of_twin_ns_ < kTwinNs) return nullptr;
  told_of_twin_ns_ = now_ns;
  notices_.push_back({fmt::format("another participant announces epoch {} of the live server, too: it is no "
                                  "server, and ignored; --secure (DDS Security) keeps such out",
                                  twin.message.epoch),
                      true});
  return nullptr;
}

// What is held stays until there is a checkpoint of the new world.
void Standby::follow(const Announcement& server) {
  notices_.push_back({fmt::format("follows the server of epoch {}", server.message.epoch)});
  live_ = server;
  heard_live_ = false;
  followed_ns_ = looked_ns_;
  silence_.begin();
  seen_applied_ = 0;
  parcels_.clear();
  fresh_ = {};
  if (checkpoint_ == nullptr) journal_ = {};
  journal_.handed_over = journal_.ended = false;
  due_since_ns_.reset();
  news_ = true;
}

// Entries of one writer come in order; numbers tell where one is missing.
void Standby::take_journal() {
  entries_.clear();
  port_->take(entries_);
  for (auto& [entry, from] : entries_) {
    if (!from_live(entry.epoch, from)) continue;
    hear();
    received_bytes_ += size_of(entry);
    if (holds_the_live()) {  // a checkpoint may overtake the entries that it covers
      journal_.add(std::move(entry), options_.id, checkpoint_->journal);
    } else {
      (checkpoint_ == nullptr ? journal_ : fresh_).add(std::move(entry), options_.id);
    }
    news_ = true;
  }
}

void Standby::take_checkpoints(std::int64_t now_ns) {
  parts_.clear();
  port_->take(parts_);
  for (auto& [part, from] : parts_) {
    if (!from_live(part.epoch, from)) continue;
    hear();
    received_bytes_ += part.bytes.size();
    if (part.frame == 0 || (holds_the_live() && part.frame <= holds())) continue;
    news_ = true;
    static_cast<void>(parcels_.add(std::move(part)));
    const auto whole = parcels_.take();
    if (!whole) continue;
    parcels_.clear();
    hold(*whole, now_ns);
  }
}

// Where only the link to the live server is bad, its clients show that it works: they apply frames that this
// server has not heard of.
void Standby::take_acknowledgements() {
  acknowledgements_.clear();
  port_->take(acknowledgements_);
  if (!holds_the_live()) return;
  const Frame heard_of = live_frame();
  for (const auto& [ack, from] : acknowledgements_) {
    if (ack.epoch != live_->message.epoch || ack.applied <= std::max(heard_of, seen_applied_)) continue;
    seen_applied_ = ack.applied;
    silence_.broken();
  }
}

void Standby::hold(const transport::CheckpointMessage& whole, std::int64_t now_ns) {
  TANDEM_ASSERT(live_);
  auto checkpoint = checkpoint::decode(whole.bytes);
  if (!checkpoint) return refuse(checkpoint.error().message, now_ns);
  if (checkpoint->frame != whole.frame || checkpoint->epoch != live_->message.epoch)
    return refuse("it is of another frame or epoch than its parts say", now_ns);
  if (auto good = accept_(*checkpoint, live_->message); !good) return refuse(good.error().message, now_ns);
  checkpoint->journal = whole.journal;
  if (!holds_the_live()) {
    notices_.push_back({fmt::format("holds the world of frame {} of epoch {}, and can take over as rank {}",
                                    checkpoint->frame, checkpoint->epoch, options_.rank)});
    if (checkpoint_ != nullptr) journal_ = std::exchange(fresh_, {});
  }
  journal_.forget_to(whole.journal);
  checkpoint_ = std::make_shared<const checkpoint::Checkpoint>(std::move(*checkpoint));
  held_ns_ = newest_ns_ = now_ns;
  told_ns_ = INT64_MIN / 2;  // the live server may wait for it
}

// The world goes on; only less of it could be continued.
void Standby::note_if_slow(std::int64_t now_ns) {
  if (!live_is_there_) newest_ns_ = now_ns;
  if (now_ns - newest_ns_ < kSlowNs) return;
  newest_ns_ = now_ns;
  notices_.push_back(
      {holds_the_live()
           ? fmt::format(
                 "falls behind: no checkpoint came for {} s, it holds frame {}, and the live server is at {}",
                 kSlowNs / kSecond, holds(), live_frame())
           : fmt::format("holds nothing of epoch {} yet: no checkpoint came for {} s", live_->message.epoch,
                         kSlowNs / kSecond),
       true});
}

void Standby::refuse(const std::string& why, std::int64_t now_ns) {
  newest_ns_ = now_ns;  // it came
  if (now_ns - refused_ns_ < kRefusedNs) return;
  refused_ns_ = now_ns;
  notices_.push_back({fmt::format("cannot stand by with the live server's checkpoint: {}", why), true});
}

void Standby::tell(std::int64_t now_ns) {
  told_ns_ = now_ns;
  news_ = false;
  if (!live_) return;
  transport::StandbyMessage message;
  message.standby = options_.id;
  message.epoch = live_->message.epoch;
  if (holds_the_live()) {
    const std::size_t usable = usable_entries();
    message.holds_frame = holds();
    message.journal = usable > 0 ? journal_.entries[usable - 1].number : checkpoint_->journal;
  }
  message.part_frame = parcels_.frame();
  message.part_count = parcels_.parts();
  message.rank = options_.rank;
  message.missing = parcels_.missing();
  static_cast<void>(port_->write(message));  // it is repeated
}

// Clients and monitors learn of this server when it could take over.
void Standby::announce() {
  transport::SessionMessage session = live_->message;
  session.epoch = options_.epoch;
  session.server_role = transport::ServerRole::kStandby;
  session.standby_rank = options_.rank;
  session.continues_epoch = 0;
  session.continues_frame = 0;
  if (announced_ == session) return;
  if (port_->write(session)) announced_ = std::move(session);
}

void Standby::publish_status(std::int64_t now_ns) {
  status_ns_ = now_ns;
  if (!live_) return;
  transport::ServerStatusMessage status;
  status.session = options_.session;
  status.epoch = options_.epoch;
  status.frame = holds();
  status.behind_frames = live_frame() - holds();
  status.server_role = transport::ServerRole::kStandby;
  status.uptime_s = static_cast<double>(now_ns - started_ns_) * 1e-9;
  status.bodies = checkpoint_ ? checkpoint_->bodies : 0;
  static_cast<void>(port_->write(status));
}

std::size_t Standby::usable_entries() const {
  if (checkpoint_ == nullptr) return 0;
  std::uint64_t next = checkpoint_->journal + 1;
  std::size_t count = 0;
  while (count < journal_.entries.size() && journal_.entries[count].number == next) ++count, ++next;
  return count;
}

Frame Standby::live_frame() const {
  for (auto entry = journal_.entries.rbegin(); entry != journal_.entries.rend(); ++entry)
    if (entry->state != transport::JournalState::kNotMade) return std::max(entry->frame, holds());
  return holds();
}

Standby::Cause Standby::cause() const {
  if (checkpoint_ == nullptr || !live_) return Cause::kNone;
  if (holds_the_live() && journal_.handed_over) return Cause::kHandedOver;
  if (!live_is_there_) return Cause::kGone;
  return is_silent() ? Cause::kSilent : Cause::kNone;
}

bool Standby::is_silent() const {
  return live_is_there_ && holds_the_live() && silence_.too_long(journal_.ended);
}

// Asked once: stepping through the journal takes a while, and the checkpoint of the last frame is on its way.
bool Standby::can_follow_the_last() {
  if (holds() == live_frame()) return true;
  const std::size_t usable = usable_entries();
  if (asked_follows_ || usable != journal_.entries.size()) return false;
  asked_follows_ = true;
  const std::vector<transport::JournalMessage> entries(journal_.entries.begin(), journal_.entries.end());
  return follows_(*checkpoint_, entries);
}

bool Standby::is_time(std::int64_t now_ns) {
  const Cause now = cause();
  if (now == Cause::kNone) {
    due_since_ns_.reset();
    asked_follows_ = false;
    return false;
  }
  if (now == Cause::kHandedOver && live_is_there_ && !is_silent()) return can_follow_the_last();
  if (!due_since_ns_) {
    due_since_ns_ = now_ns;
    if (is_silent())
      notices_.push_back(
          {fmt::format("the live server of epoch {} has sent nothing for {:.1f} s, so it hangs",
                       live_->message.epoch, static_cast<double>(silence_.lasts_ns()) * 1e-9),
           true});
    return false;  // the next poll sees who else could take over
  }
  return now_ns - *due_since_ns_ >= before_us_ * kRankNs;
}

Takeover Standby::take_over() {
  TANDEM_ASSERT(checkpoint_ != nullptr && live_);
  Takeover takeover;
  takeover.published = live_frame();
  takeover.handed_over = cause() == Cause::kHandedOver;
  takeover.checkpoint = checkpoint_;
  const auto usable = static_cast<std::ptrdiff_t>(usable_entries());
  takeover.journal.assign(std::make_move_iterator(journal_.entries.begin()),
                          std::make_move_iterator(journal_.entries.begin() + usable));
  takeover.from = live_->from;
  port_->unfollow();
  return takeover;
}

std::vector<Standby::Notice> Standby::take_notices() { return std::exchange(notices_, {}); }

}  // namespace tandem::standby
