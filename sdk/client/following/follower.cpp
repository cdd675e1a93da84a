#include "sdk/client/following/follower.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::client {
namespace {

ResyncReason reason_of(DeltaAssembly::Outcome outcome) {
  switch (outcome) {
    case DeltaAssembly::Outcome::kGap:
      return ResyncReason::kGap;
    case DeltaAssembly::Outcome::kLostPart:
      return ResyncReason::kLostPart;
    case DeltaAssembly::Outcome::kOverflow:
      return ResyncReason::kOverflow;
    default:
      return ResyncReason::kRefused;
  }
}

}  // namespace

std::string Follower::Loss::text() const {
  std::string text = describe(reason);
  text += ", frame ";
  text += std::to_string(frame);
  if (error.empty()) return text;
  text += ": ";
  text += error;
  return text;
}

Follower::Follower(transport::StreamMessage announced, ClientTimeline empty, double frame_rate_hz,
                   std::uint32_t join_attempts, std::int64_t now_ns)
    : stream_(std::move(announced)),
      timeline_(std::move(empty)),
      deltas_({.earlier = transport::max_earlier(stream_.layout.capacity),
               .period_ns = period_ns_of(frame_rate_hz),
               .delta_bytes = stream_.max_delta_bytes}),
      snapshot_(stream_.max_snapshot_bytes),
      joiner_(join_attempts),
      lag_(frame_rate_hz) {
  join_again(now_ns);
}

Result<void> Follower::open(transport::ClientPort& port, const transport::SessionMessage& session,
                            transport::ClientId client) {
  if (is_open_) return {};
  auto opened = port.open_stream(session, stream_, client);
  is_open_ = opened.has_value();
  return opened;
}

bool Follower::ask(std::int64_t now_ns) {
  if (!joiner_.poll(now_ns)) return false;
  ++asks_;
  repeat_ns_ = kLeastRepeatNs;
  return true;
}

const CompleteDelta* Follower::oldest() const {
  if (!fetching_) return deltas_.front();
  return unread_.empty() ? nullptr : &unread_.front();
}

bool Follower::too_old(Frame frame_of_snapshot) const {
  const CompleteDelta* const first = oldest();
  if (first == nullptr) return fetching_ && frame_of_snapshot < timeline_.applied();
  return frame_of_snapshot + 1 < first->frame;
}

SnapshotAssembly::Outcome Follower::take(transport::SnapshotMessage&& part, std::int64_t now_ns) {
  using Outcome = SnapshotAssembly::Outcome;
  // A snapshot that is too old was made for an earlier joiner.
  if (!(joining_ || fetching_) || !joiner_.asked() || too_old(part.frame)) return Outcome::kIgnored;
  const Outcome outcome = snapshot_.add(std::move(part));
  if (outcome != Outcome::kStored) return outcome;
  heard_ns_ = now_ns;
  joiner_.progress(now_ns);
  part_unacknowledged_ = true;
  if (auto whole = snapshot_.take()) joiner_.offer(std::move(*whole));
  return outcome;
}

void Follower::tell_progress(transport::AckMessage& ack) {
  part_unacknowledged_ = false;
  repeat_ns_ = std::min(2 * repeat_ns_, kMaxRepeatNs);
  ack.snapshot_frame = snapshot_.frame();
  ack.snapshot_parts = snapshot_.parts();
  ack.missing = snapshot_.missing();
}

std::optional<transport::SnapshotMessage> Follower::choose_snapshot(std::int64_t now_ns) {
  // The deltas in between were lost meanwhile, or sent before this client read them.
  if (snapshot_.parts() > 0 && too_old(snapshot_.frame())) {
    snapshot_.reject();
    joiner_.ask_again(now_ns);
  }
  const CompleteDelta* const first = oldest();
  auto chosen = joiner_.choose(first != nullptr ? std::optional(first->frame) : std::nullopt, now_ns);
  if (chosen && fetching_ && chosen->frame > timeline_.applied()) {  // deltas up to it are still to come
    joiner_.offer(std::move(*chosen));
    chosen.reset();
  }
  return chosen;
}

Result<void> Follower::load(const transport::SnapshotMessage& snapshot, transport::ClientPort& port,
                            std::int64_t now_ns) {
  TANDEM_ASSERT(joining_ && !fetching_);
  auto loaded = timeline_.load(snapshot.bytes, snapshot.epoch, stream_.id);
  if (loaded && timeline_.applied() != snapshot.frame) {
    loaded = fail(ErrorCode::kMalformed, "snapshot of another frame than announced");
  }
  if (!loaded) {
    snapshot_.reject();
    joiner_.ask_again(now_ns);
    return loaded;
  }
  port.close_snapshots(stream_.id.id);
  snapshot_.clear();
  deltas_.drop_through(snapshot.frame);
  joining_ = false;
  input_missing_ns_.reset();
  return loaded;
}

void Follower::join_again(std::int64_t now_ns) {
  stop_fetching();
  joining_ = true;
  heard_ns_ = now_ns;
  input_missing_ns_.reset();
  lag_.reset();
  asks_ = 0;
  joiner_.start(now_ns);
}

void Follower::forget_deltas(transport::ClientPort& port) {
  deltas_.clear();
  close(port);
  is_open_ = false;
}

void Follower::keep_state(bool on, std::int64_t now_ns) {
  if (on == keeps_state_) return;
  keeps_state_ = on;
  stop_fetching();
  if (joining_ || !on || timeline_.holds_state()) return;
  fetching_ = true;
  snapshot_.clear();
  joiner_.start(now_ns);
}

void Follower::stop_fetching() {
  fetching_ = false;
  unread_.clear();
  unread_bytes_ = 0;
}

void Follower::keep_unread(const CompleteDelta& delta) {
  constexpr std::size_t kMaxDeltas = 1024, kMaxBytes = 64U << 20U;
  TANDEM_ASSERT(unread_.empty() || unread_.back().frame + 1 == delta.frame);  // without a gap
  unread_.push_back(delta);
  unread_bytes_ += delta.payload.size();
  while (unread_.size() > kMaxDeltas || unread_bytes_ > kMaxBytes) {  // a later snapshot will do
    unread_bytes_ -= unread_.front().payload.size();
    unread_.pop_front();
  }
}

std::optional<Follower::Loss> Follower::fetch(const transport::SnapshotMessage& snapshot,
                                              const ScheduledInputs& scheduled, transport::ClientPort& port) {
  TANDEM_ASSERT(fetching_ && !joining_);
  auto good = timeline_.load(snapshot.bytes, snapshot.epoch, stream_.id);
  for (const CompleteDelta& delta : unread_) {
    if (good && delta.frame > timeline_.applied()) good = scheduled.hand_over(timeline_, delta.last_input);
    if (good && delta.frame > timeline_.applied())
      good = timeline_.apply(delta.frame, delta.last_input, delta.hash, delta.payload);
  }
  port.close_snapshots(stream_.id.id);
  snapshot_.clear();
  stop_fetching();
  if (good) return std::nullopt;
  const bool mismatch = good.error().code == ErrorCode::kMismatch;
  return Loss{mismatch ? ResyncReason::kMismatch : ResyncReason::kRefused, snapshot.frame,
              std::move(good.error().message)};
}

Follower::Step Follower::take(transport::DeltaMessage&& part, std::int64_t now_ns) {
  using Outcome = DeltaAssembly::Outcome;
  const Frame frame = part.frame;
  const bool last_part = part.part + 1 == part.parts;
  const Outcome outcome = deltas_.add(std::move(part));
  // If nothing was buffered, deltas may come that the snapshot already contains.
  if (!joining_) deltas_.drop_through(timeline_.applied());
  if (outcome == Outcome::kStored) {
    if (!joining_) heard_ns_ = now_ns;
    return {.done = last_part};
  }
  if (outcome == Outcome::kIgnored) return {};
  // A joining client restarts its buffer. After a gap the requested snapshot may still fit the deltas that
  // follow.
  if (joining_ && outcome != Outcome::kGap && outcome != Outcome::kLostPart) joiner_.ask_again(now_ns);
  return {.loss = Loss{reason_of(outcome), frame}};
}

Follower::Step Follower::apply_front(const ScheduledInputs& scheduled, std::int64_t waited_ns) {
  TANDEM_ASSERT(!joining_ && waited_ns >= 0);
  const CompleteDelta* const delta = deltas_.front();
  if (delta == nullptr) return {};
  const Frame frame = delta->frame;
  if (frame != timeline_.applied() + 1) return {.loss = Loss{ResyncReason::kGap, frame}};
  auto applied = scheduled.hand_over(timeline_, delta->last_input);
  if (!applied) return {.loss = Loss{ResyncReason::kRefused, frame, std::move(applied.error().message)}};
  if (timeline_.inputs_held() < delta->last_input) return wait_for_inputs(frame, waited_ns);
  input_missing_ns_.reset();
  const bool reads = keeps_state_ && timeline_.holds_state();
  applied = reads ? timeline_.apply(frame, delta->last_input, delta->hash, delta->payload)
                  : timeline_.pass(frame, delta->last_input, delta->hash);
  if (applied && fetching_) keep_unread(*delta);
  if (applied) return {.done = true};
  deltas_.pop();  // this delta is useless now, but those behind it are not
  const bool mismatch = applied.error().code == ErrorCode::kMismatch;
  return {.loss = Loss{mismatch ? ResyncReason::kMismatch : ResyncReason::kRefused, frame,
                       std::move(applied.error().message)}};
}

// Waits for the inputs that `frame` needs.
Follower::Step Follower::wait_for_inputs(Frame frame, std::int64_t waited_ns) {
  input_missing_ns_ = input_missing_ns_ ? *input_missing_ns_ + waited_ns : 0;
  if (*input_missing_ns_ < kInputPatienceNs) return {};
  return {.loss = Loss{ResyncReason::kMissingInput, frame}};
}

std::optional<Follower::Loss> Follower::check_lag(std::int64_t now_ns) {
  TANDEM_ASSERT(!joining_);
  if (!lag_.exceeded(deltas_.size(), now_ns)) return std::nullopt;
  return Loss{ResyncReason::kLag, timeline_.applied()};
}

}  // namespace tandem::client
