// The choice of a stream under a cap: idl/STATES.md, "The choice of a stream".
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "sdk/client/session/stream_choice.hpp"

namespace tandem::client {

namespace {

bool differ_by_caps(const StreamOffer& a, const StreamOffer& b) {
  return a.cap_kbit_s > 0 && b.cap_kbit_s > 0 && a.cap_kbit_s != b.cap_kbit_s &&
         a.first_threshold == b.first_threshold;
}

// What a cap costs a stream is not known before somebody plays it.
bool is_tried(const StreamOffer& offer) {
  return offer.cap_kbit_s == 0 || offer.threshold > offer.first_threshold;
}

}  // namespace

double StreamChooser::takes_kbit_s(const Candidate& candidate) {
  if (candidate.over_kbit_s > 0) return candidate.over_kbit_s;
  return candidate.offer.cap_kbit_s > 0 ? candidate.offer.cap_kbit_s : candidate.wire_kbit_s;
}

bool StreamChooser::within_cap(const Candidate& candidate) const {
  if (cap_kbit_s_ == 0) return true;
  const double takes = takes_kbit_s(candidate);
  return takes > 0 && takes <= cap_kbit_s_;
}

// Of two that begin alike the server makes the one with the larger cap finer. What a stream has in force is
// not known before somebody plays it.
bool StreamChooser::finer(const Candidate& a, const Candidate& b) {
  const std::uint32_t of_a = a.offer.cap_kbit_s, of_b = b.offer.cap_kbit_s;
  if (differ_by_caps(a.offer, b.offer)) return of_a > of_b;
  const bool alike = of_a == of_b && a.offer.first_threshold == b.offer.first_threshold;
  const bool counts = !alike || (is_tried(a.offer) && is_tried(b.offer));
  if (counts && a.offer.threshold != b.offer.threshold) return a.offer.threshold < b.offer.threshold;
  if (a.offer.suits_others != b.offer.suits_others) return b.offer.suits_others;
  // They take the same then, and a dearer step would not be offered if it gained nothing.
  if (!counts && a.offer.announced_ns != b.offer.announced_ns)
    return a.offer.announced_ns > b.offer.announced_ns;
  if ((of_a == 0) != (of_b == 0)) return of_a == 0;
  return of_a != of_b ? of_a > of_b : fewer_bits(a, b);
}

bool StreamChooser::worthwhile_under_cap(const Candidate& other, const Candidate& present) const {
  if (differ_by_caps(other.offer, present.offer)) return finer(other, present);
  return is_tried(other.offer) && other.offer.threshold < kWorthwhile * present.offer.threshold;
}

// The cap decides before the delay: also a stream whose delay suits others.
std::optional<std::size_t> StreamChooser::best_within_cap(std::int64_t now_ns) const {
  if (cap_kbit_s_ == 0) return std::nullopt;
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < offers_.size(); ++i) {
    const Candidate& candidate = offers_[i];
    if (!within_cap(candidate) || now_ns < candidate.barred_until_ns || candidate.is_unreachable) continue;
    const bool fitter = best && fits(candidate, kMaxShare) != fits(offers_[*best], kMaxShare);
    if (!best || (fitter ? fits(candidate, kMaxShare) : finer(candidate, offers_[*best]))) best = i;
  }
  return best;
}

// A stream without a cap may be played only if the server says that it takes little.
bool StreamChooser::awaits_wire() const {
  const auto named = find_named();
  for (std::size_t i = 0; i < offers_.size(); ++i) {
    if (named.value_or(i) == i && offers_[i].offer.cap_kbit_s == 0 && takes_kbit_s(offers_[i]) <= 0)
      return true;
  }
  return false;
}

std::optional<std::uint32_t> StreamChooser::needed_kbit_s() const {
  if (!is_over_) return std::nullopt;
  const auto named = find_named();
  double least = 0;
  for (std::size_t i = 0; i < offers_.size(); ++i) {
    const double takes = takes_kbit_s(offers_[i]);
    if (named.value_or(i) == i && takes > 0 && (least <= 0 || takes < least)) least = takes;
  }
  return static_cast<std::uint32_t>(std::min(std::ceil(least), 4294967295.0));
}

bool StreamChooser::leave_for_cap(const Seen& seen) {
  const std::uint64_t before = std::exchange(wire_bytes_, seen.wire_bytes);
  if (cap_kbit_s_ == 0) return false;
  // What a snapshot took is no stream's.
  const bool counts = before > 0 && seen.wire_bytes >= before && !seen.idle_since_ns;
  const auto bits = static_cast<double>(seen.wire_bytes - before) * 8;
  const double kbit_s = counts ? bits * 1e6 / static_cast<double>(seen.now_ns - looked_ns_) : 0;
  over_seconds_ = kbit_s > kTolerance * cap_kbit_s_ ? over_seconds_ + 1 : 0;
  if (over_seconds_ < kOverSeconds) return false;
  Candidate& present = offers_[chosen_];
  present.over_kbit_s = kbit_s;
  const auto other = find_named() ? std::nullopt : best_within_cap(seen.now_ns);
  is_over_ = !other;
  return leave_for(other,
                   present.offer.name + " takes " + std::to_string(std::llround(kbit_s)) + " of " +
                       std::to_string(cap_kbit_s_) + " kbit/s",
                   seen.now_ns);
}

}  // namespace tandem::client
