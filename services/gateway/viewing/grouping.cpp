#include "services/gateway/viewing/grouping.hpp"

#include <cmath>
#include <utility>
#include <variant>

#include "sdk/wire/envelope.hpp"
#include "sdk/wire/frame_bundle.hpp"

namespace tandem::gateway {
namespace {

OutgoingPtr join(const LiveLog& log, LiveLog::Place begin, LiveLog::Place end) {
  transport::FrameBundle bundle;
  transport::DeltaMessage last;
  for (LiveLog::Place place = begin; place < end; ++place) {
    auto message = transport::read_gateway_envelope(log.at(place)->envelope());
    TANDEM_ASSERT(message && std::holds_alternative<transport::DeltaMessage>(*message));
    last = std::get<transport::DeltaMessage>(std::move(*message));
    for (const transport::FrameRun& run : transport::read_frames(last)) {
      for (Frame frame = run.last - run.before; frame <= run.last; ++frame)
        bundle.add(frame, run.hash, run.payload);
    }
  }
  transport::DeltaMessage joined = bundle.take();
  joined.epoch = last.epoch;
  joined.stream = last.stream;
  joined.last_input = last.last_input;
  joined.server_time_ns = last.server_time_ns;
  return make_outgoing(joined);
}

}  // namespace

void Grouping::start(const LiveLog& log, std::uint32_t capacity, double frame_rate_hz) {
  *this = {};
  for (Collected& collected : collected_) collected.released = log.end();
  max_frames_ = transport::max_earlier(capacity) + 1;
  if (frame_rate_hz > 0) period_ns_ = std::llround(1e9 / frame_rate_hz);
}

void Grouping::added(const LiveLog& log, std::int64_t now_ns) {
  const LiveLog::Place newest = log.end() - 1;
  if (log.frame(newest) == 0) {
    // The delta behind a scheduled input says that it counts it, and then both leave.
    for (Collected& collected : collected_) {
      if (!collected.since_ns) collected.since_ns = now_ns;
    }
    return;
  }
  const std::int64_t frames_ns = (std::int64_t{log.earlier(newest)} + 1) * period_ns_;
  const std::size_t bytes = log.joined_bytes(newest);
  const bool acts = std::exchange(last_input_, log.input(newest)) != log.input(newest) &&
                    (!input_ns_ || now_ns - *input_ns_ >= kInputSpacingNs);
  if (acts) input_ns_ = now_ns;
  for (Steps steps = 1; steps <= kMaxSteps; ++steps) {
    Collected& collected = collected_[steps - 1];
    // Its first frame has waited for the others at the server. The next message is expected to be like this
    // one, and would be too late after the delay.
    if (!collected.since_ns) collected.since_ns = now_ns - (frames_ns - period_ns_);
    collected.bytes += bytes;
    if (acts || collected.bytes + bytes > kMaxBytes ||
        now_ns + frames_ns - *collected.since_ns > delay_ns(steps))
      let_go(collected, log);
  }
}

void Grouping::release(const LiveLog& log, std::int64_t now_ns) {
  for (Steps steps = 1; steps <= kMaxSteps; ++steps) {
    if (now_ns >= due_ns(steps)) let_go(collected_[steps - 1], log);
  }
}

void Grouping::let_go(Collected& collected, const LiveLog& log) {
  collected.released = log.end();
  collected.since_ns.reset();
  collected.bytes = 0;
}

OutgoingPtr Grouping::take(const LiveLog& log, LiveLog::Place& place, LiveLog::Place until, Steps steps) {
  const LiveLog::Place begin = place;
  place = log.shared_until(begin, until, max_frames_, kMaxBytes);
  if (place == begin + 1) return log.at(begin);
  Collected& collected = collected_[steps - 1];
  if (collected.message == nullptr || collected.begin != begin || collected.end != place) {
    collected.begin = begin;
    collected.end = place;
    collected.message = join(log, begin, place);
  }
  return collected.message;
}

}  // namespace tandem::gateway
