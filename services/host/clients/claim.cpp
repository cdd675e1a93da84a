#include "services/host/clients/claim.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace tandem::host {
namespace {

std::string participant_name(const transport::ParticipantId& id) {
  std::string text;
  for (const std::uint8_t byte : id.bytes) text += fmt::format("{:02x}", byte);
  return text;
}

// Far more than the clients of a session.
constexpr std::size_t kMaxParticipants = 4096;
constexpr std::size_t kMaxNoted = 64;

}  // namespace

void Claim::acknowledged(Epoch epoch, const transport::ParticipantId& from, std::int64_t now_ns) {
  if (newest_.size() < kMaxParticipants || newest_.contains(from)) newest_[from] = {epoch, now_ns};
}

std::ptrdiff_t Claim::followers(Epoch epoch) const {
  return std::ranges::count_if(newest_, [epoch](const auto& entry) { return entry.second.epoch == epoch; });
}

// Decides when the numbers of followers do not.
bool Claim::comes_first(const Other& other) const {
  const Epoch theirs = other.message.epoch;
  const Epoch apart = theirs > epoch_ ? theirs - epoch_ : epoch_ - theirs;
  if (apart > kOlderMs) return epoch_ < theirs;
  return self_ < other.from;
}

bool Claim::continues_ours(const Other& other) const {
  return other.message.server_role == transport::ServerRole::kLive &&
         other.message.continues_epoch == epoch_ && may_succeed_ && may_succeed_(other.from);
}

bool Claim::gives_way(const Other& other, std::int64_t now_ns) {
  if (!announced_ns_) return true;
  const bool settled = now_ns - *announced_ns_ >= kSettledNs;
  const std::ptrdiff_t ours = followers(epoch_), theirs = followers(other.message.epoch);
  const bool tie_counts = ours > 0 || !settled;
  // Where nobody follows either of them, the world that went on elsewhere goes on.
  const bool succeeded = theirs == ours && continues_ours(other);
  const bool behind = theirs > ours || succeeded || (theirs == ours && tie_counts && !comes_first(other));
  if (!behind) {
    behind_since_.erase(other.from);
    return false;
  }
  const std::int64_t since_ns = behind_since_.try_emplace(other.from, now_ns).first->second;
  return !settled || now_ns - since_ns >= kBehindNs;
}

bool Claim::imitates(const Other& other, std::int64_t now_ns) const {
  const Epoch epoch = other.message.epoch;
  if (epoch == taken_over_) return other.from != ignored_;
  return epoch == epoch_ && announced_ns_ && now_ns - *announced_ns_ >= kSettledNs;
}

void Claim::note(const Other& other, bool imitates, Notices& notices, std::int64_t now_ns) {
  if (std::ranges::find(noted_, other.from) != noted_.end()) return;
  if (noted_.size() >= kMaxNoted) noted_.erase(noted_.begin());
  noted_.push_back(other.from);
  const std::string who = participant_name(other.from);
  notices.add(
      imitates
          ? fmt::format(
                "participant {} announces epoch {}, which is another's: it is no server, and ignored; "
                "--secure (DDS Security) keeps such out",
                who, other.message.epoch)
          : fmt::format(
                "another server announces this session, too (epoch {}, participant {}), but this one keeps it",
                other.message.epoch, who),
      now_ns);
}

std::optional<Error> Claim::check(transport::ServerPort& port, Notices& notices, std::int64_t now_ns) {
  std::erase_if(newest_, [now_ns](const auto& entry) { return now_ns - entry.second.at_ns > kFollowedNs; });
  others_.clear();
  port.take_sessions(others_);
  std::erase_if(behind_since_, [this](const auto& entry) {
    return std::ranges::none_of(others_, [&](const Other& o) { return o.from == entry.first; });
  });
  is_continued_ = std::ranges::any_of(others_, [this](const Other& other) { return continues_ours(other); });
  has_standby_ = std::ranges::any_of(others_, [this](const Other& other) {
    return other.from != self_ && other.message.server_role == transport::ServerRole::kStandby;
  });
  has_rival_ = false;
  for (const Other& other : others_) {
    if (other.from == self_ || other.message.server_role != transport::ServerRole::kLive) continue;
    if (other.from == ignored_ && (!announced_ns_ || now_ns - *announced_ns_ < kIgnoredNs)) continue;
    if (!port.vouches_for_servers() && imitates(other, now_ns)) {
      note(other, true, notices, now_ns);
      continue;
    }
    if (!gives_way(other, now_ns)) {
      has_rival_ = true;
      note(other, false, notices, now_ns);
      continue;
    }
    return Error{ErrorCode::kConflict,
                 fmt::format("session '{}' already has a server: epoch {}, participant {}; choose another "
                             "--session or stop that one",
                             other.message.session, other.message.epoch, participant_name(other.from))};
  }
  return std::nullopt;
}

}  // namespace tandem::host
