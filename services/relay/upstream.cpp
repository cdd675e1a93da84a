#include "services/relay/upstream.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::relay {

using transport::Reason;

namespace {
constexpr std::size_t kMaxScheduled = 4096;  // that wait to be taken
}

Feed::Feed(std::uint32_t stream, client::CoreOptions options, std::unique_ptr<transport::ClientPort> port)
    : stream_(stream), port_(std::move(port)), client_(std::move(options), *port_) {}

void Feed::lose() {
  plays_ = false;
  queue_.clear();
  queued_bytes_ = 0;
}

void Feed::on_session(const transport::SessionMessage& session) {
  const bool another = session.epoch != epoch_;
  lose();
  if (another) scheduled_.clear();
  epoch_ = session.epoch;
}

void Feed::on_snapshot(const transport::SnapshotMessage& snapshot) {
  const transport::StreamMessage* const stream = client_.core().stream();
  lose();
  // Without the stream that it was made for, a client plays another one.
  plays_ = stream != nullptr && stream->id.id == stream_;
  frame_ = snapshot.frame;
  ++joins_;
}

void Feed::on_scheduled(const transport::ScheduledInputMessage& input, std::int64_t /*now_ns*/) {
  if (scheduled_.size() < kMaxScheduled) scheduled_.push_back(input);
}

void Feed::on_applied(const client::CompleteDelta& delta, std::int64_t /*now_ns*/) {
  if (!plays_) return;
  if (queued_bytes_ + delta.payload.size() > kMaxQueuedBytes || queue_.size() >= kMaxQueued) {
    queue_.clear();  // nobody takes them: who does later finds a gap
    queued_bytes_ = 0;
  }
  frame_ = delta.frame;
  queued_bytes_ += delta.payload.size();
  queue_.push_back(delta);
}

client::CompleteDelta Feed::take_oldest() {
  TANDEM_ASSERT(!queue_.empty() && queue_.front().payload.size() <= queued_bytes_);
  client::CompleteDelta oldest = std::move(queue_.front());
  queue_.pop_front();
  queued_bytes_ -= oldest.payload.size();
  return oldest;
}

void Feed::keep_latest(std::size_t count) {
  while (queue_.size() > count) take_oldest();
}

void Feed::on_outcome(const client::InputOutcome& outcome, std::int64_t /*now_ns*/) {
  outcomes_.push_back(outcome);
}

Upstream::Upstream(Options options, MakePort make_port)
    : options_(std::move(options)), make_port_(std::move(make_port)) {}

Result<std::unique_ptr<Upstream>> Upstream::create(Options options, MakePort make_port) {
  std::unique_ptr<Upstream> upstream(new Upstream(std::move(options), std::move(make_port)));
  if (auto followed = upstream->follow(0); !followed) return tl::unexpected(followed.error());
  return upstream;
}

client::CoreOptions Upstream::core_options(std::uint32_t stream, transport::ClientId id) const {
  client::CoreOptions core;
  core.session = options_.session;
  core.prefer = std::to_string(stream);
  core.id = id;
  core.max_delay_ms = 0;
  // The others only watch, and are never waited for.
  core.role = stream == 0 ? transport::Role::kParticipant : transport::Role::kObserver;
  core.log = options_.log;
  core.measure_ns = options_.measure_ns;
  core.prepares = false;
  return core;
}

Result<void> Upstream::follow(std::uint32_t stream) {
  TANDEM_ASSERT(stream < wanted_ns_.size());
  const transport::ClientId id = options_.new_id();
  auto port = make_port_(id);
  if (!port) return tl::unexpected(port.error());
  feeds_[stream] = std::make_unique<Feed>(stream, core_options(stream, id), std::move(*port));
  want_state(stream);  // who wants the stream joins it
  return {};
}

Feed* Upstream::feed(std::uint32_t stream) {
  const auto found = feeds_.find(stream);
  return found == feeds_.end() ? nullptr : found->second.get();
}

void Upstream::want(std::uint32_t stream) {
  if (stream >= wanted_ns_.size()) return;
  wanted_ns_[stream] = now_.steady_ns;
  if (feeds_.contains(stream)) return;
  if (const auto followed = follow(stream); !followed && options_.log)
    options_.log(LogLevel::kWarning,
                 "stream " + std::to_string(stream) + " cannot be followed: " + followed.error().message);
}

void Upstream::want_state(std::uint32_t stream) {
  if (stream < state_wanted_ns_.size()) state_wanted_ns_[stream] = now_.steady_ns;
}

void Upstream::stand_by(std::int64_t keep_ns) {
  const transport::SessionMessage* const now = session();
  if (now == nullptr) return;
  for (const transport::StreamMessage& stream : now->streams)
    if (stream.carries == stream.id.id) want(stream.id.id);
  const double frames = static_cast<double>(keep_ns) * 1e-9 * std::clamp(now->frame_rate_hz, 1.0, 1000.0);
  each_feed([frames](Feed& feed) { feed.keep_latest(static_cast<std::size_t>(frames)); });
}

void Upstream::each_feed(const std::function<void(Feed&)>& each) {
  for (const auto& [stream, feed] : feeds_) each(*feed);
}

std::int64_t Upstream::poll(client::Now now) {
  now_ = now;
  for (const std::uint32_t stream : std::exchange(options_.streams, {})) want(stream);
  std::erase_if(feeds_, [this](const auto& entry) {
    return entry.first != 0 && now_.steady_ns - wanted_ns_[entry.first] > kLingerNs;
  });
  std::int64_t due_ns = INT64_MAX;
  for (auto& [stream, feed] : feeds_) {
    feed->keep_state(options_.keeps_state || now.steady_ns - state_wanted_ns_[stream] < kStateNs);
    due_ns = std::min(due_ns, feed->poll(now));
  }
  for (const client::InputOutcome& outcome : std::exchange(first().outcomes(), {}))
    merger_.on_outcome(outcome, verdicts_);
  merger_.flush(first().client(), now.steady_ns, verdicts_);
  if (merger_.waiting()) due_ns = std::min(due_ns, now.steady_ns + kSecond / 20);
  return due_ns;
}

void Upstream::prepare() {
  for (auto& [stream, feed] : feeds_) feed->client().prepare();
}

void Upstream::send(const transport::InputMessage& input) {
  const accounts::InputClaim claim{input.client, input.number, input.kind};
  if (!following::InputMerger::well_formed(input)) {
    verdicts_.push_back({.reason = Reason::kInvalid, .claim = claim});
  } else if (first().client().role() == transport::Role::kObserver) {
    verdicts_.push_back({.reason = Reason::kObserver, .claim = claim});
  } else {
    merger_.add(input.client, input, first().client(), now_.steady_ns, verdicts_);
  }
}

void Upstream::take_outcomes(std::vector<accounts::InputVerdict>& out) {
  std::ranges::move(verdicts_, std::back_inserter(out));
  verdicts_.clear();
}

void Upstream::forget_inputs() {
  merger_.clear();
  verdicts_.clear();
}

}  // namespace tandem::relay
