#include "services/follow/following/input_merger.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::following {

using transport::InputKind;
using transport::Reason;

namespace {

void decide(const std::vector<InputMerger::Claim>& claims, Reason reason,
            std::vector<InputMerger::Verdict>& out) {
  for (const InputMerger::Claim& claim : claims) out.push_back({.reason = reason, .claim = claim});
}

}  // namespace

bool InputMerger::well_formed(const transport::InputMessage& input) {
  const bool finite = std::ranges::all_of(input.values, [](double value) { return std::isfinite(value); });
  switch (static_cast<InputKind>(input.kind)) {
    case InputKind::kGravity:
      return finite && input.values.size() == 3 && input.bytes.empty();
    case InputKind::kPush:
      return finite && input.values.size() == 7 && input.bytes.empty();
    case InputKind::kSeek:
      return finite && input.values.size() == 1 && input.bytes.empty();
    case InputKind::kApplication:
      return finite;
  }
  return false;
}

void InputMerger::add(SenderId sender, transport::InputMessage input, FollowedWorld& world,
                      std::int64_t now_ns, std::vector<Verdict>& out) {
  TANDEM_ASSERT(well_formed(input));
  const Claim claim{sender, input.number, input.kind};
  if (input.kind == static_cast<std::uint32_t>(InputKind::kGravity)) {
    gravity_ = std::move(input);
    gravity_claims_.push_back(claim);
    return flush(world, now_ns, out);
  }
  if (!others_.take(now_ns)) return decide({claim}, Reason::kRateLimited, out);
  send(input, {claim}, world, now_ns, out);
}

void InputMerger::flush(FollowedWorld& world, std::int64_t now_ns, std::vector<Verdict>& out) {
  if (gravity_claims_.empty() || !gravities_.take(now_ns)) return;
  send(gravity_, std::exchange(gravity_claims_, {}), world, now_ns, out);
}

void InputMerger::send(const transport::InputMessage& input, std::vector<Claim> claims, FollowedWorld& world,
                       std::int64_t now_ns, std::vector<Verdict>& out) {
  const auto number = world.send(static_cast<InputKind>(input.kind), input.values, input.bytes, now_ns);
  if (!number) {
    const bool invalid = number.error().code == ErrorCode::kInvalidArgument;
    return decide(claims, invalid ? Reason::kInvalid : Reason::kNotPlaying, out);
  }
  ++sent_;
  unanswered_.emplace(*number, std::move(claims));
}

void InputMerger::on_outcome(const client::InputOutcome& outcome, std::vector<Verdict>& out) {
  using Kind = client::InputOutcome::Kind;
  if (outcome.kind == Kind::kLost) {
    std::erase_if(acted_, [&](const Acted& acted) {
      if (acted.number != outcome.number) return false;
      out.push_back({.fate = Verdict::Fate::kLost, .claim = acted.claim});
      return true;
    });
  }
  const auto claims = unanswered_.extract(outcome.number);
  if (claims.empty()) return;
  Verdict verdict{.acts_on = outcome.frame, .text = outcome.text};
  if (outcome.kind == Kind::kRefused) verdict.reason = static_cast<Reason>(outcome.reason);
  if (outcome.kind == Kind::kUnknown) verdict.fate = Verdict::Fate::kUnknown;
  if (outcome.kind == Kind::kLost) verdict.fate = Verdict::Fate::kLost;
  for (const Claim& claim : claims.mapped()) {
    verdict.claim = claim;
    out.push_back(verdict);
    if (outcome.kind == Kind::kActed) acted_.push_back({outcome.number, claim});
  }
  while (acted_.size() > kMaxActed) acted_.pop_front();
}

void InputMerger::carry_over(std::vector<Verdict>& out) {
  for (const Claim& claim : std::exchange(gravity_claims_, {}))
    out.push_back({.fate = Verdict::Fate::kLost, .claim = claim});
}

void InputMerger::clear() {
  gravity_claims_.clear();
  unanswered_.clear();
  acted_.clear();
}

}  // namespace tandem::following
