#include "sdk/client/drawing/sampled_moment.hpp"

#include <algorithm>

namespace tandem::client {
namespace {

// A longer distance between two samples means nothing; the limit keeps floats finite.
constexpr double kFarFrames = 1000;

float bounded(double frames) { return static_cast<float>(std::clamp(frames, -kFarFrames, kFarFrames)); }

// Velocities are v + a in the first frame beyond the last, v + 2 a in the second, and so on; the drawn
// velocity contains the first a.
double fall_after(double beyond) { return beyond > 1 ? beyond * (beyond - 1) / 2 : 0; }

// If the moment leaps ahead of the clock, for example after an interruption, the leap is a correction.
void since_last(SampledMoment& moment, double start, double last_frame, double elapsed) {
  moment.span.gap = bounded(std::min(std::max(0.0, start - last_frame), elapsed));
  moment.span.since =
      bounded(std::min(moment.frame - std::max(start, last_frame), elapsed - moment.span.gap));
}

// The bodies drawn last already move at the echo's speed of that time.
void add_echo(const GravityEcho& echo, double rate_hz, SampledMoment& moment) {
  const double longest = SampledMoment::kEchoS * rate_hz;
  const Span& span = moment.span;
  const auto speed = [longest](double since) { return since < longest ? since : 0; };
  const double now = std::clamp(moment.frame - echo.frame, 0.0, longest);
  const double before = std::clamp(moment.frame - span.since - span.gap - echo.frame, 0.0, longest);
  moment.echo.place = bounded(now * now / 2);
  moment.echo.way = bounded((now * now - before * before) / 2 - speed(before) * span.gap);
  moment.echo.speed = bounded(speed(now)) * span.pace;
  for (std::size_t axis = 0; axis < kPositionChannels; ++axis)
    moment.echo_gravity[axis] = echo.gravity[axis] - static_cast<float>(moment.at->gravity[axis]);
}

}  // namespace

SampledMoment moment_at(const Picture& picture, SampleMode mode, std::int64_t at_ns, double least_frame,
                        double last_frame, double elapsed) {
  const DrawnFrame& agreed = *picture.agreed;
  const DrawnFrame* last = mode == SampleMode::kExtrapolate ? picture.ahead : picture.agreed;
  const DrawnFrame* first = picture.before != nullptr ? picture.before : picture.agreed;
  const auto number = [](const DrawnFrame* frame) { return static_cast<double>(frame->frame); };
  double wanted = number(&agreed);
  if (picture.pacer.known()) {
    wanted = mode == SampleMode::kExtrapolate ? picture.pacer.server_frame(at_ns)
                                              : picture.pacer.arrived_frame(at_ns) - 1;
  }
  const double rate_hz = 1e9 / picture.pacer.period_ns();
  SampledMoment moment;
  if (std::max(wanted, least_frame) < number(last) || mode == SampleMode::kInterpolate) {
    moment.frame = std::clamp(std::max(wanted, least_frame), number(first), number(last));
    moment.at = moment.frame <= number(&agreed) ? picture.agreed : last;
    moment.from = moment.at == picture.agreed ? first : picture.agreed;
    moment.span.after = bounded(moment.frame - number(moment.at));
    since_last(moment, number(moment.from), last_frame, elapsed);
    if (moment.from == moment.at)
      moment.from = nullptr;  // there is no way from an earlier frame; bodies have their own speed
    if (picture.echo && mode == SampleMode::kExtrapolate) add_echo(*picture.echo, rate_hz, moment);
    return moment;
  }
  const double full = std::max(1.0, SampledMoment::kFullSpeedS * rate_hz);
  const double slowing = SampledMoment::kSlowingS * rate_hz;
  const double slowed = std::clamp(wanted - number(last) - full, 0.0, slowing);
  // The clock's estimate may have gone back, or the last frame, if the client simulates less far ahead than
  // before: then bodies wait where they were drawn.
  const double beyond =
      std::max(std::min(wanted - number(last), full) + slowed * (1 - slowed / (2 * slowing)),
               least_frame - number(last));
  moment.frame = number(last) + beyond;
  moment.at = last;
  moment.span.after = bounded(beyond);
  moment.span.pace = static_cast<float>(1 - slowed / slowing);
  since_last(moment, number(last), last_frame, elapsed);
  moment.fall.place = bounded(fall_after(beyond));
  moment.fall.way = bounded(fall_after(beyond) - fall_after(beyond - moment.span.since));
  if (beyond > 1) moment.fall.speed = bounded(beyond - 0.5) * moment.span.pace;
  if (picture.echo) add_echo(*picture.echo, rate_hz, moment);
  return moment;
}

}  // namespace tandem::client
