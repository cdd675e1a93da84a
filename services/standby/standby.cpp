#include "services/standby/standby.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "services/checkpoint/format.hpp"

namespace tandem::standby {
namespace {

constexpr std::int64_t kLongestWakeNs = 50 * kMillisecond;
constexpr std::int64_t kLookNs = 50 * kMillisecond;
constexpr std::int64_t kTellNs = kSecond / 4;
constexpr std::int64_t kTellSoonNs = 20 * kMillisecond;  // while something arrives
constexpr std::int64_t kRefusedNs = 10 * kSecond;        // between two lines about refused checkpoints

std::size_t size_of(const transport::JournalMessage& entry) {
  std::size_t size = sizeof entry;
  for (const transport::InputDecision& decision : entry.decisions)
    size += sizeof decision + decision.values.size() * sizeof(double) + decision.bytes.size();
  return size;
}

}  // namespace

Standby::Standby(Options options, transport::ServerPort& port, Accept accept)
    : options_(std::move(options)), port_(&port), accept_(std::move(accept)) {}

Result<std::unique_ptr<Standby>> Standby::create(Options options, transport::ServerPort& port,
                                                 Accept accept) {
  if (auto followed = port.follow(options.id); !followed) return tl::unexpected(followed.error());
  return std::unique_ptr<Standby>(new Standby(std::move(options), port, std::move(accept)));
}

bool Standby::poll(std::int64_t now_ns) {
  if (started_ns_ == 0) started_ns_ = now_ns;
  if (now_ns - looked_ns_ >= kLookNs || gone_ns_) look_around(now_ns);
  take_journal();
  take_checkpoints(now_ns);
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
  const auto place = std::pair(options_.rank, port_->self());
  for (const Announcement& server : servers_) {
    if (server.from == port_->self()) continue;
    if (server.message.server_role == transport::ServerRole::kStandby) {
      if (std::pair(server.message.standby_rank, server.from) < place) ++before_us_;
    } else if (from_live(server.message.epoch, server.from)) {
      live_is_there_ = true;
      live_->message = server.message;
    } else if (other == nullptr || server.message.epoch > other->message.epoch) {
      other = &server;
    }
  }
  if (!live_is_there_ && other != nullptr) {
    follow(*other);
    live_is_there_ = true;
  }
  if (live_is_there_ && !was_last()) gone_ns_.reset();
  if (checkpoint_ != nullptr && live_) announce();
}

void Standby::follow(const Announcement& server) {
  notices_.push_back(fmt::format("follows the server of epoch {}", server.message.epoch));
  live_ = server;
  checkpoint_.reset();
  assembly_.clear();
  journal_.clear();
  journal_bytes_ = 0;
  gone_ns_.reset();
  news_ = true;
}

// Entries of one writer come in order; numbers tell where one is missing.
void Standby::take_journal() {
  entries_.clear();
  port_->take(entries_);
  for (auto& [entry, from] : entries_) {
    if (!from_live(entry.epoch, from)) continue;
    if (!journal_.empty() && entry.number <= journal_.back().number) continue;
    if (journal_.size() >= kMostEntries || journal_bytes_ >= kMostJournalBytes) continue;
    journal_bytes_ += size_of(entry);
    journal_.push_back(std::move(entry));
    news_ = true;
  }
}

void Standby::take_checkpoints(std::int64_t now_ns) {
  parts_.clear();
  port_->take(parts_);
  for (auto& [part, from] : parts_) {
    if (!from_live(part.epoch, from) || part.frame <= holds()) continue;
    news_ = true;
    if (auto whole = assembly_.add(std::move(part))) hold(*whole, now_ns);
  }
}

void Standby::hold(const Assembly::Whole& whole, std::int64_t now_ns) {
  auto checkpoint = checkpoint::decode(whole.bytes);
  if (!checkpoint) return refuse(checkpoint.error().message, now_ns);
  if (checkpoint->frame != whole.frame || checkpoint->epoch != live_->message.epoch)
    return refuse("it is of another frame or epoch than its parts say", now_ns);
  if (auto good = accept_(*checkpoint); !good) return refuse(good.error().message, now_ns);
  checkpoint->journal = whole.journal;
  if (checkpoint_ == nullptr)
    notices_.push_back(fmt::format("holds the world of frame {} of epoch {}, and can take over as rank {}",
                                   checkpoint->frame, checkpoint->epoch, options_.rank));
  while (!journal_.empty() && journal_.front().number <= whole.journal) {
    journal_bytes_ -= size_of(journal_.front());
    journal_.pop_front();
  }
  checkpoint_ = std::make_shared<const checkpoint::Checkpoint>(std::move(*checkpoint));
  told_ns_ = INT64_MIN / 2;  // the live server may wait for it
}

void Standby::refuse(const std::string& why, std::int64_t now_ns) {
  if (now_ns - refused_ns_ < kRefusedNs) return;
  refused_ns_ = now_ns;
  notices_.push_back(fmt::format("cannot stand by with the live server's checkpoint: {}", why));
}

void Standby::tell(std::int64_t now_ns) {
  told_ns_ = now_ns;
  news_ = false;
  if (!live_) return;
  transport::StandbyMessage message;
  message.standby = options_.id;
  message.epoch = live_->message.epoch;
  message.holds_frame = holds();
  const std::size_t usable = usable_entries();
  message.journal = usable > 0 ? journal_[usable - 1].number : (checkpoint_ ? checkpoint_->journal : 0);
  message.part_frame = assembly_.frame();
  message.part_count = assembly_.parts();
  message.rank = options_.rank;
  message.missing = assembly_.missing();
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
  while (count < journal_.size() && journal_[count].number == next) ++count, ++next;
  return count;
}

Frame Standby::live_frame() const {
  for (auto entry = journal_.rbegin(); entry != journal_.rend(); ++entry)
    if (entry->state != transport::JournalState::kNotMade) return std::max(entry->frame, holds());
  return holds();
}

bool Standby::was_last() const {
  return !journal_.empty() && journal_.back().state == transport::JournalState::kLast;
}

bool Standby::is_time(std::int64_t now_ns) {
  if (checkpoint_ == nullptr || (live_is_there_ && !was_last())) return false;
  if (!gone_ns_) {
    gone_ns_ = now_ns;
    look_around(now_ns);  // who else could take over
  }
  return now_ns - *gone_ns_ >= before_us_ * kRankNs;
}

Takeover Standby::take_over() {
  Takeover takeover;
  takeover.checkpoint = checkpoint_;
  const auto usable = static_cast<std::ptrdiff_t>(usable_entries());
  takeover.journal.assign(std::make_move_iterator(journal_.begin()),
                          std::make_move_iterator(journal_.begin() + usable));
  takeover.from = live_->from;
  takeover.handed_over =
      !takeover.journal.empty() && takeover.journal.back().state == transport::JournalState::kLast;
  port_->unfollow();
  return takeover;
}

std::vector<std::string> Standby::take_notices() { return std::exchange(notices_, {}); }

}  // namespace tandem::standby
