#include "services/host/claim.hpp"

#include <fmt/format.h>

#include <string>

namespace tandem::host {
namespace {

std::string participant_name(const transport::ParticipantId& id) {
  std::string text;
  for (const std::uint8_t byte : id.bytes) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace

bool Claim::stays(const transport::Received<transport::SessionMessage>& other) const {
  const Epoch theirs = other.message.epoch;
  const Epoch apart = theirs > epoch_ ? theirs - epoch_ : epoch_ - theirs;
  if (apart > kOlderMs) return epoch_ < theirs;
  return self_ < other.from;
}

std::optional<Error> Claim::check(transport::ServerPort& port, bool announced) {
  others_.clear();
  port.take_sessions(others_);
  for (const auto& other : others_) {
    if (other.from == self_ || (announced && stays(other))) continue;
    return Error{ErrorCode::kConflict,
                 fmt::format("session '{}' already has a server: epoch {}, participant {}; choose another "
                             "--session or stop that one",
                             other.message.session, other.message.epoch, participant_name(other.from))};
  }
  return std::nullopt;
}

}  // namespace tandem::host
