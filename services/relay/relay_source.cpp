#include "services/relay/relay_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::relay {

namespace {
constexpr std::size_t kMaxHeld = 4096;  // scheduled inputs
}

RelaySource::RelaySource(Upstream& upstream) : upstream_(&upstream), session_(*upstream.session()) {
  // Each stream once, by the offer that encodes; these stand first.
  std::erase_if(session_.streams,
                [](const transport::StreamMessage& offer) { return offer.carries != offer.id.id; });
  TANDEM_ASSERT(upstream.first().playing() && session_.streams.size() <= transport::kMaxStreams);
  // What it has kept while another relay passed the session on is published too: who missed some of it when
  // that one ended finds it here.
  const auto& queue = upstream.first().queue();
  frame_ = queue.empty() ? upstream.first().frame() : queue.front().frame - 1;
  goes_on_ = !queue.empty();
}

host::ServiceConfig RelaySource::config_of(const transport::SessionMessage& session) {
  host::ServiceConfig config;
  config.session = session.session;
  config.epoch = session.epoch;
  config.frame_rate_hz = session.frame_rate_hz;
  config.free_rate = true;
  config.stall_timeout_ns.reset();
  config.window_ceiling = std::clamp(session.window_ceiling, 1U, 64U);
  return config;
}

Feed* RelaySource::playing(std::uint32_t stream) const {
  Feed* const feed = upstream_->feed(stream);
  return feed != nullptr && feed->playing() && feed->epoch() == session_.epoch ? feed : nullptr;
}

bool RelaySource::goes_on(std::uint32_t stream) const {
  Feed* const feed = playing(stream);
  if (feed == nullptr) return false;
  const auto& queue = feed->queue();
  return queue.empty() ? feed->frame() == frame_ : queue.front().frame == frame_ + 1;
}

// The first stream decides: where it joined again, the frames in between are lost to everybody.
void RelaySource::align() {
  for (std::uint32_t id = 0; id < session_.streams.size(); ++id) {
    Feed* const feed = playing(id);
    if (feed == nullptr) {
      synced_[id] = false;
      continue;
    }
    while (!feed->queue().empty() && feed->queue().front().frame <= frame_) feed->take_oldest();
    synced_[id] = goes_on(id);
  }
  if (synced_.any()) return;
  Feed* const feed = playing(0);
  if (feed == nullptr) return;
  const auto& queue = feed->queue();
  const Frame from = queue.empty() ? feed->frame() : queue.front().frame - 1;
  if (from == frame_) return;
  if (passed_on_)  // otherwise nobody waits for them
    notices_.push_back(
        fmt::format("frames {} to {} were lost on the way here: all join again", frame_ + 1, from));
  frame_ = from;
  align();
}

host::StreamSet RelaySource::active() const {
  const host::StreamSet active = wanted_ & synced_;
  return active.any() ? active : host::StreamSet{1};
}

void RelaySource::set_active(host::StreamSet streams) {
  wanted_ = streams;
  for (std::uint32_t id = 0; id < session_.streams.size(); ++id)
    if (streams[id]) upstream_->want(id);
}

host::StreamSet RelaySource::prepare(host::StreamSet streams) {
  align();
  host::StreamSet ready;
  for (std::uint32_t id = 0; id < session_.streams.size(); ++id) {
    if (!streams[id]) continue;
    upstream_->want(id);
    upstream_->want_state(id);
    ready[id] = synced_[id] && upstream_->feed(id)->queue().empty() && upstream_->feed(id)->holds_state();
  }
  return ready;
}

bool RelaySource::next_ready() {
  align();
  host::StreamSet with, without;
  for (std::uint32_t id = 0; id < session_.streams.size(); ++id) {
    if (synced_[id]) (upstream_->feed(id)->queue().empty() ? without : with).set(id);
  }
  if (with.none()) return false;
  bool waits = false;
  for (std::uint32_t id = 0; id < session_.streams.size(); ++id) {
    if (!without[id]) {
      late_ns_[id] = 0;
      continue;
    }
    if (late_ns_[id] == 0) late_ns_[id] = upstream_->now_ns();
    waits = waits || upstream_->now_ns() - late_ns_[id] < kLateNs;
  }
  return !waits;
}

void RelaySource::hold_scheduled() {
  for (std::uint32_t id = 0; id < session_.streams.size(); ++id) {
    Feed* const feed = upstream_->feed(id);
    if (feed == nullptr || feed->epoch() != session_.epoch) continue;
    for (transport::ScheduledInputMessage& input : feed->scheduled()) {
      if (input.number > scheduled_to_ && input.epoch == session_.epoch)
        scheduled_.emplace(input.number, std::move(input));
    }
    feed->scheduled().clear();
  }
  while (scheduled_.size() > kMaxHeld) scheduled_.erase(scheduled_.begin());
}

// Scheduled inputs leave in front of the delta that counts them.
std::optional<host::MadeFrame> RelaySource::next(host::StreamSet /*snapshots_follow*/, host::Outbox& outbox) {
  if (goes_on_ && !all_until_ns_) all_until_ns_ = upstream_->now_ns() + kAllNs;
  const bool all = all_until_ns_ && upstream_->now_ns() < *all_until_ns_;
  hold_scheduled();
  while (!scheduled_.empty() && outbox.has_control_room()) {  // who misses it asks for it, or joins again
    const auto first = scheduled_.begin();
    scheduled_to_ = first->first;
    const bool queued = outbox.push(std::move(first->second));
    TANDEM_ASSERT(queued);
    scheduled_.erase(first);
  }
  taken_.clear();
  deltas_.clear();
  host::MadeFrame made;
  std::vector<std::uint32_t> streams;
  for (std::uint32_t id = 0; id < session_.streams.size(); ++id) {
    Feed* const feed = playing(id);
    if (feed == nullptr || feed->queue().empty() || feed->queue().front().frame != frame_ + 1) {
      synced_[id] = false;
      continue;
    }
    client::CompleteDelta delta = feed->take_oldest();
    made.last_input = std::max(made.last_input, delta.last_input);
    if (all) upstream_->want(id);
    if (!wanted_[id] && !all) continue;
    streams.push_back(id);
    taken_.push_back(std::move(delta));
  }
  made.frame = ++frame_;
  passed_on_ = true;
  for (std::size_t i = 0; i < taken_.size(); ++i)
    // Frames stay together as they came.
    deltas_.push_back({.stream = streams[i],
                       .hash = taken_[i].hash,
                       .payload = taken_[i].payload,
                       .at_once = taken_[i].more == 0});
  made.deltas = deltas_;
  return made;
}

void RelaySource::snapshot(std::uint32_t stream, std::vector<std::byte>& out) {
  out.clear();
  if (Feed* const feed = playing(stream)) {
    if (auto cut = feed->client().cut()) out = std::move(cut->bytes);
  }
}

const State& RelaySource::agreed(std::uint32_t stream) const {
  Feed* const feed = playing(stream);
  if (feed == nullptr || !feed->holds_state()) return none_;
  const ClientTimeline& timeline = *feed->client().core().timeline();
  return timeline.state(timeline.applied());
}

host::BodyCounts RelaySource::bodies(std::uint32_t stream) const {
  Feed* const feed = playing(stream);
  if (feed == nullptr || feed->holds_state() || !feed->status()) return FrameSource::bodies(stream);
  return {.alive = feed->status()->bodies, .at_rest = feed->status()->at_rest};
}

std::uint64_t RelaySource::hash(std::uint32_t stream) const {
  Feed* const feed = playing(stream);
  return feed == nullptr ? 0 : feed->client().core().timeline()->hash();
}

const StreamParameters& RelaySource::parameters(std::uint32_t stream) const {
  Feed* const feed = playing(stream);
  return feed == nullptr ? session_.streams[stream].layout.parameters
                         : feed->client().core().timeline()->parameters();
}

host::InputVerdict RelaySource::accept(const transport::InputMessage& input,
                                       const host::InputTerms& /*terms*/, host::Outbox& /*outbox*/) {
  if (input.client == 0) return {transport::Reason::kRecording};
  upstream_->send(input);
  return {.fate = host::InputVerdict::Fate::kLater};
}

bool RelaySource::refresh_names() {
  const transport::SessionMessage* const now = upstream_->session();
  if (now == nullptr || now->epoch != session_.epoch || now->names == session_.names) return false;
  session_.names = now->names;
  return true;
}

std::string RelaySource::name(std::uint32_t stream) const {
  const std::string& name = session_.streams[stream].name;
  return name.empty() ? std::to_string(stream) : name;
}

std::vector<std::string> RelaySource::take_notices(std::int64_t /*now_ns*/) {
  return std::exchange(notices_, {});
}

}  // namespace tandem::relay
