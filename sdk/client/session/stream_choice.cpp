#include "sdk/client/session/stream_choice.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/wire/limits.hpp"

namespace tandem::client {
namespace {

// Several losses within this time are attributed to the link.
constexpr std::int64_t kLossSpanNs = 30 * kSecond;
constexpr std::size_t kManyLosses = 2;
// If frames arrive at less than this part of the rate, over a link whose round trip has grown, they are
// queued in the link.
constexpr double kFullRate = 0.85;
constexpr std::int64_t kQueuedNs = 150 * kMillisecond;

std::string milliseconds(double ns) {
  const std::int64_t tenths = std::llround(ns / 1e5);
  return std::to_string(tenths / 10) + '.' + std::to_string(tenths % 10);
}

}  // namespace

StreamPreference read_preference(std::string_view text) {
  using Kind = StreamPreference::Kind;
  if (text.empty() || text == "auto") return {};
  if (text == "bandwidth") return {.kind = Kind::kBandwidth};
  if (text == "computing") return {.kind = Kind::kComputing};
  if (text == "error") return {.kind = Kind::kError};
  return {.kind = Kind::kNamed, .name = std::string(text)};
}

std::vector<StreamOffer> list_offers(const transport::SessionMessage& session,
                                     const std::vector<std::size_t>& playable, std::uint32_t max_delay_ms) {
  const auto misfit = [max_delay_ms](const transport::StreamMessage& stream) {
    return stream.delay_ms <= max_delay_ms ? max_delay_ms - stream.delay_ms
                                           : transport::kMaxDelayMs + stream.delay_ms;
  };
  std::vector<StreamOffer> offers;
  for (const std::size_t index : playable) {
    const transport::StreamMessage& stream = session.streams[index];
    const bool suits_others = std::any_of(playable.begin(), playable.end(), [&](std::size_t other_index) {
      const transport::StreamMessage& other = session.streams[other_index];
      return other.layout_hash == stream.layout_hash && other.cap_kbit_s == stream.cap_kbit_s &&
             misfit(other) < misfit(stream);
    });
    offers.push_back({.index = index,
                      .id = stream.id,
                      .name = stream.name.empty() ? std::to_string(stream.carries) : stream.name,
                      .is_ballistic = stream.layout.predictor == basic_predictor().name,
                      .threshold = stream.layout.parameters.codec.threshold * session.lattice_unit,
                      .per_body_ns = double{1} * stream.client_cost_ns,
                      .announced_ns = double{1} * stream.client_cost_ns * session.capacity,
                      .cap_kbit_s = stream.cap_kbit_s,
                      .first_threshold = stream.layout.parameters.codec.threshold * session.lattice_unit,
                      .misfit = misfit(stream),
                      .suits_others = suits_others});
  }
  return offers;
}

std::optional<double> measure_own_step(std::int64_t (*clock_ns)()) {
  if (clock_ns == nullptr) return std::nullopt;
  constexpr std::uint32_t kBodies = 4096;
  constexpr int kMaxSteps = 1024;  // limit for a clock that stands still or nearly does
  constexpr std::int64_t kEnoughNs = 20 * kMillisecond;
  const auto predictor = make_predictor(basic_predictor().name, kBodies, {});
  if (!predictor) return std::nullopt;
  State state(kBodies);
  for (Slot slot = 0; slot < kBodies; ++slot)
    state.spawn(slot, 0, 0, {.p = {static_cast<std::int32_t>(slot), 0, 0}, .v = {64, 0, 0}});
  StateHasher hasher;
  const StepInput input;
  const std::int64_t began_ns = clock_ns();
  std::int64_t took_ns = 0;
  int steps = 0;
  while (took_ns < kEnoughNs && steps < kMaxSteps) {
    (*predictor)->step(state, state, input);
    static_cast<void>(hasher.hash(state));
    ++steps;
    took_ns = clock_ns() - began_ns;
  }
  if (took_ns <= 0) return std::nullopt;
  return static_cast<double>(took_ns) / steps / kBodies;
}

StreamChooser::StreamChooser(std::vector<StreamOffer> offers, StreamPreference preference, double period_ns,
                             std::optional<double> own_step_ns, std::uint32_t cap_kbit_s)
    : preference_(std::move(preference)), period_ns_(period_ns), cap_kbit_s_(cap_kbit_s) {
  for (StreamOffer& offer : offers) offers_.push_back({.offer = std::move(offer)});
  if (own_step_ns) {
    const auto ballistic = std::find_if(offers_.begin(), offers_.end(), [](const Candidate& c) {
      return c.offer.is_ballistic && c.offer.announced_ns > 0;
    });
    if (ballistic != offers_.end())
      slowness_ = std::clamp(*own_step_ns / ballistic->offer.per_body_ns, 0.1, 1000.0);
  }
  choose_anew();
}

bool StreamChooser::wants_status() const {
  using Kind = StreamPreference::Kind;
  if (cap_kbit_s_ > 0) return awaits_wire();
  if (preference_.kind == Kind::kNamed || preference_.kind == Kind::kComputing) return false;
  const double share = preference_.kind == Kind::kAutomatic ? kEasyShare : kMaxShare;
  int fitting = 0;
  bool all_told = true;
  for (const Candidate& candidate : offers_) {
    if (candidate.offer.suits_others || !fits(candidate, share)) continue;
    ++fitting;
    all_told = all_told && candidate.is_told;
  }
  return fitting > 1 && !all_told;
}

void StreamChooser::choose_anew() {
  reason_ = choose_first();
  is_over_ = !within_cap(offers_[chosen_]);
  before_ = chosen_;
}

std::string StreamChooser::choose_first() {
  std::string but;
  if (preference_.kind == StreamPreference::Kind::kNamed) {
    if (const auto named = find_named()) {
      chosen_ = *named;
      return "asked for by name";
    }
    but = ", as there is no stream '" + preference_.name + "'";
    preference_ = {};
  }
  const Best first = best(INT64_MAX);
  chosen_ = first.index;
  const auto suits = [](const Candidate& candidate) { return !candidate.offer.suits_others; };
  return (std::count_if(offers_.begin(), offers_.end(), suits) == 1 ? "the only one" : first.why) + but;
}

double StreamChooser::cost_ns(const Candidate& candidate) const {
  return candidate.measured_ns > 0 ? candidate.measured_ns : candidate.offer.announced_ns * slowness_;
}

// Compares like with like: a measured frame contains more than its announced step.
double StreamChooser::relative_cost(const Candidate& a, const Candidate& b) {
  const bool measured = a.measured_ns > 0 && b.measured_ns > 0;
  const double of_a = measured ? a.measured_ns : a.offer.announced_ns;
  const double of_b = measured ? b.measured_ns : b.offer.announced_ns;
  return of_b > 0 ? of_a / of_b : 1;
}

bool StreamChooser::fits(const Candidate& candidate, double share) const {
  return cost_ns(candidate) <= share * period_ns_;
}

// If rates are unknown: a more expensive step saves bits, because nobody would offer it otherwise, and so
// does a coarser threshold.
bool StreamChooser::fewer_bits(const Candidate& a, const Candidate& b) {
  if (a.bits_per_s > 0 && b.bits_per_s > 0) return a.bits_per_s < b.bits_per_s;
  if (a.offer.announced_ns != b.offer.announced_ns) return a.offer.announced_ns > b.offer.announced_ns;
  return a.offer.threshold > b.offer.threshold;
}

template <class Admits, class Less>
std::optional<std::size_t> StreamChooser::best_of(std::int64_t now_ns, Admits&& admits, Less&& less) const {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < offers_.size(); ++i) {
    if (offers_[i].offer.suits_others || now_ns < offers_[i].barred_until_ns || offers_[i].is_unreachable ||
        !within_cap(offers_[i]) || !admits(offers_[i]))
      continue;
    if (!best || less(offers_[i], offers_[*best])) best = i;
  }
  return best;
}

std::size_t StreamChooser::cheapest(std::int64_t now_ns) const {
  return best_of(
             now_ns, [](const Candidate&) { return true; },
             [](const Candidate& a, const Candidate& b) { return relative_cost(a, b) < 1; })
      .value_or(chosen_);
}

StreamChooser::Best StreamChooser::best(std::int64_t now_ns) const {
  using Kind = StreamPreference::Kind;
  if (const auto found = best_within_cap(now_ns)) return {*found, "smallest error within the cap"};
  const auto fewer = [](const Candidate& a, const Candidate& b) { return fewer_bits(a, b); };
  const auto keeps_up = [this](const Candidate& c) { return fits(c, kMaxShare); };
  switch (preference_.kind) {
    case Kind::kBandwidth:
      if (const auto found = best_of(now_ns, keeps_up, fewer)) return {*found, "fewest bits"};
      break;
    case Kind::kError: {
      const auto finer = [](const Candidate& a, const Candidate& b) {
        return a.offer.threshold != b.offer.threshold ? a.offer.threshold < b.offer.threshold
                                                      : fewer_bits(a, b);
      };
      if (const auto found = best_of(now_ns, keeps_up, finer)) return {*found, "smallest error"};
      break;
    }
    case Kind::kAutomatic: {
      const auto easy = [this](const Candidate& c) { return fits(c, kEasyShare); };
      if (const auto found = best_of(now_ns, easy, fewer)) return {*found, "fewest bits of the easy ones"};
      break;
    }
    case Kind::kComputing:
    case Kind::kNamed:
      break;
  }
  return {cheapest(now_ns), "cheapest step"};
}

// Compares by what the preference is about. A stream with unknown figures is worth a try.
bool StreamChooser::worthwhile(const Candidate& other, const Candidate& present) const {
  using Kind = StreamPreference::Kind;
  if (cap_kbit_s_ > 0) return worthwhile_under_cap(other, present);
  if (preference_.kind == Kind::kError && other.offer.threshold < present.offer.threshold) return true;
  const bool by_cost = preference_.kind == Kind::kComputing || !fits(present, 2 * kEasyShare);
  if (preference_.kind != Kind::kBandwidth && by_cost) return relative_cost(other, present) < kWorthwhile;
  if (other.bits_per_s > 0 && present.bits_per_s > 0)
    return other.bits_per_s < kWorthwhile * present.bits_per_s;
  return fewer_bits(other, present);
}

void StreamChooser::on_status(const transport::ServerStatusMessage& status) {
  for (Candidate& candidate : offers_) {
    if (candidate.offer.id.id != status.stream) continue;
    candidate.is_told = true;
    if (status.threshold > 0) candidate.offer.threshold = status.threshold;
    // The rate of a stream that nobody plays is what the server measured last. It is new if it differs.
    const bool is_new = status.mbit_per_s != candidate.told_mbit_per_s;
    candidate.told_mbit_per_s = status.mbit_per_s;
    candidate.wire_kbit_s = std::max(0.0, status.wire_mbit_per_s * kBitsPerMbit / 1000);
    if (status.mbit_per_s > 0) candidate.bits_per_s = status.mbit_per_s * kBitsPerMbit;
    candidate.is_played = candidate.is_played || is_new || status.participants + status.observers > 0;
  }
}

void StreamChooser::on_frame(std::int64_t cost_ns) {
  costs_.add(cost_ns);
  ++frames_;
}

void StreamChooser::on_loss(std::int64_t now_ns) {
  std::erase_if(losses_ns_, [now_ns](std::int64_t at_ns) { return now_ns - at_ns > kLossSpanNs; });
  if (losses_ns_.size() < kManyLosses) losses_ns_.push_back(now_ns);
}

void StreamChooser::look_at_last_second(const Seen& seen) {
  Candidate& present = offers_[chosen_];
  if (frames_ > 0 && !seen.idle_since_ns) {
    const double median_ns = 1e6 * costs_.quantile_ms(0.5);
    if (median_ns > 0) present.measured_ns = median_ns;
  }
  slow_seconds_ = frames_ > 0 && !fits(present, kMaxShare) ? slow_seconds_ + 1 : 0;
  starved_seconds_ = starved(seen) ? starved_seconds_ + 1 : 0;
  costs_.clear();
  frames_ = 0;
}

// Forgets the figures of streams that are not played here: a hot processor or a wild scene may have calmed
// down.
void StreamChooser::forget_old_figures(std::int64_t now_ns) {
  for (Candidate& candidate : offers_) {
    if (std::exchange(candidate.is_played, false) || &candidate == &offers_[chosen_])
      candidate.played_ns = now_ns;
    if (candidate.played_ns != INT64_MIN && now_ns - candidate.played_ns >= kKnownNs)
      candidate.bits_per_s = 0;
    if (candidate.barred_until_ns == INT64_MIN || now_ns < candidate.barred_until_ns) continue;
    candidate.barred_until_ns = INT64_MIN;
    candidate.is_unreachable = false;
    candidate.measured_ns = candidate.over_kbit_s = 0;
  }
}

template <class Is>
std::optional<std::size_t> StreamChooser::find(Is&& is) const {
  const auto found = std::find_if(offers_.begin(), offers_.end(),
                                  [&is](const Candidate& candidate) { return is(candidate.offer); });
  if (found == offers_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - offers_.begin());
}

std::optional<std::size_t> StreamChooser::find_named() const {
  if (preference_.kind != StreamPreference::Kind::kNamed) return std::nullopt;
  std::optional<std::size_t> named;
  for (std::size_t i = 0; i < offers_.size(); ++i) {
    const StreamOffer& offer = offers_[i].offer;
    if (offer.name == preference_.name && (!named || offer.misfit < offers_[*named].offer.misfit)) named = i;
  }
  if (named) return named;
  return find([this](const StreamOffer& o) { return std::to_string(o.id.id) == preference_.name; });
}

// True if fewer frames come than the session has while messages are queued on the way. A server that waits
// for another client or is slow itself does not change the round trip.
bool StreamChooser::starved(const Seen& seen) const {
  if (seen.idle_since_ns || seen.round_trip_ns == 0 || best_round_trip_ns_ == 0) return false;
  const auto elapsed_ns = static_cast<double>(seen.now_ns - looked_ns_);
  const bool late = static_cast<double>(frames_) * period_ns_ < kFullRate * elapsed_ns;
  return late && seen.round_trip_ns > 2 * best_round_trip_ns_ + kQueuedNs;
}

void StreamChooser::prefer(StreamPreference preference) {
  preference_ = std::move(preference);
  is_new_preference_ = true;
}

bool StreamChooser::reconsider(const Seen& seen) {
  if (looked_ns_ == INT64_MIN) looked_ns_ = changed_ns_ = seen.now_ns;
  if (std::exchange(is_new_preference_, false)) {
    const std::size_t before = chosen_;
    std::string why = choose_first();
    is_over_ = !within_cap(offers_[chosen_]);
    const std::size_t wanted = std::exchange(chosen_, before);
    if (wanted != before) {
      change(wanted, std::move(why), seen.now_ns);
      return true;
    }
    reason_ = std::move(why);
  }
  if ((offers_.size() == 1 && cap_kbit_s_ == 0) || seen.now_ns - looked_ns_ < kLookNs) return false;
  if (seen.round_trip_ns > 0 && (best_round_trip_ns_ == 0 || seen.round_trip_ns < best_round_trip_ns_))
    best_round_trip_ns_ = seen.round_trip_ns;
  look_at_last_second(seen);
  const bool left = leave_for_cap(seen);
  looked_ns_ = seen.now_ns;
  forget_old_figures(seen.now_ns);
  if (left || offers_.size() == 1) return left;
  if (changed_lately(seen.now_ns)) return false;
  if (seen.idle_since_ns) {  // a join that makes progress is not given up for another
    return seen.now_ns - std::max(*seen.idle_since_ns, changed_ns_) >= kLongJoinNs &&
           leave_link("nothing of " + offers_[chosen_].offer.name + " came for 10 s while joining",
                      seen.now_ns);
  }
  if (const auto named = find_named()) {  // another stream is chosen only after a change that was given up
    if (*named == chosen_ || seen.now_ns < offers_[*named].barred_until_ns) return false;
    change(*named, "asked for by name", seen.now_ns);
    return true;
  }
  const std::string name = offers_[chosen_].offer.name;
  const bool hopeless = slow_seconds_ > 0 && !fits(offers_[chosen_], kHopelessShare);
  if ((hopeless || slow_seconds_ >= kSlowSeconds) && leave_slow(hopeless, seen.now_ns)) return true;
  if (losses_ns_.size() >= kManyLosses && seen.now_ns - losses_ns_.front() <= kLossSpanNs &&
      leave_link("the link loses " + name, seen.now_ns))
    return true;
  if (starved_seconds_ >= kStarvedSeconds && leave_link("the link is too thin for " + name, seen.now_ns))
    return true;
  const Best wanted = best(seen.now_ns);
  const bool better = wanted.index != chosen_ && worthwhile(offers_[wanted.index], offers_[chosen_]);
  better_seconds_ = better && wanted.index == better_ ? better_seconds_ + 1 : (better ? 1 : 0);
  better_ = wanted.index;
  if (better_seconds_ < kBetterSeconds || seen.now_ns - changed_ns_ < dwell_ns_) return false;
  dwell_ns_ = std::min(2 * dwell_ns_, kMaxDwellNs);
  change(wanted.index, wanted.why, seen.now_ns);
  return true;
}

bool StreamChooser::leave_slow(bool hopeless, std::int64_t now_ns) {
  const Candidate& present = offers_[chosen_];
  std::optional<std::size_t> other = cheapest(INT64_MAX);  // also a stream that was left because of the link
  if (hopeless) {
    other = best_of(
        now_ns, [&](const Candidate& c) { return &c != &present; },
        [](const Candidate& a, const Candidate& b) { return relative_cost(a, b) < 1; });
  } else if (relative_cost(offers_[*other], present) >= kWorthwhile) {
    return false;
  }
  return leave_for(other,
                   "a frame of " + present.offer.name + " takes " + milliseconds(cost_ns(present)) + " of " +
                       milliseconds(period_ns_) + " ms",
                   now_ns);
}

bool StreamChooser::leave_link(const std::string& what, std::int64_t now_ns) {
  const Candidate& present = offers_[chosen_];
  return leave_for(
      best_of(
          now_ns,
          [&](const Candidate& c) { return &c != &present && fewer_bits(c, present) && fits(c, kMaxShare); },
          [](const Candidate& a, const Candidate& b) { return fewer_bits(a, b); }),
      what, now_ns);
}

void StreamChooser::bar(Candidate& candidate, std::int64_t now_ns) {
  candidate.barred_until_ns = now_ns + candidate.barred_ns;
  candidate.barred_ns = std::min(2 * candidate.barred_ns, kMaxBarredNs);
}

bool StreamChooser::leave_for(std::optional<std::size_t> other, std::string why, std::int64_t now_ns) {
  if (!other || *other == chosen_) return false;
  if (changed_lately(now_ns)) return false;
  bar(offers_[chosen_], now_ns);
  change(*other, std::move(why), now_ns);
  return true;
}

void StreamChooser::change(std::size_t to, std::string why, std::int64_t now_ns) {
  before_ = std::exchange(chosen_, to);
  reason_before_ = std::exchange(reason_, std::move(why));
  changed_ns_ = now_ns;
  left_ns_ = now_ns;
  slow_seconds_ = starved_seconds_ = better_seconds_ = over_seconds_ = 0;
  losses_ns_.clear();
  costs_.clear();
  frames_ = 0;
}

void StreamChooser::keep(const StreamId& chosen, const StreamId& before) {
  chosen_ = find([&](const StreamOffer& o) { return o.id == chosen; }).value_or(chosen_);
  before_ = find([&](const StreamOffer& o) { return o.id == before; }).value_or(chosen_);
  is_over_ = false;
}

void StreamChooser::gave_up(std::int64_t now_ns) {
  bar(offers_[chosen_], now_ns);
  offers_[chosen_].is_unreachable = true;
  change(before_, reason_before_, now_ns);
}

}  // namespace tandem::client
