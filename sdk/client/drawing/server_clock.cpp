#include "sdk/client/drawing/server_clock.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tandem::client {
namespace {

// Both clocks are bounded here so that differences of received stamps cannot overflow.
constexpr std::int64_t kClockLimitNs = std::numeric_limits<std::int64_t>::max() / 4;
// Stamps that differ by less than this do not contradict: the kernel slews a wall clock by less in one span.
constexpr std::int64_t kToleranceNs = 2'000'000;
// Weight of a new stamp in the phase and in the jitter: 1/8 settles within half a second at 30 Hz.
constexpr double kPhaseGain = 1.0 / 8;
constexpr double kJitterGain = 1.0 / 16;
// If a delta is off by more than this many periods, the server was suspended or runs at another rate.
constexpr double kRestartPeriods = 1.5;

std::int64_t bounded(std::int64_t time_ns) { return std::clamp(time_ns, -kClockLimitNs, kClockLimitNs); }

}  // namespace

void ServerClock::Bound::turn(std::int64_t now_ns, std::int64_t none) {
  if (turned_ns == kNone) turned_ns = now_ns;
  if (now_ns - turned_ns < kSpanNs) return;
  previous = std::exchange(current, none);
  turned_ns = now_ns;
}

void ServerClock::contradicted() {
  lower_.current = lower_.previous = kNone;
  upper_.current = upper_.previous = kUnbounded;
}

void ServerClock::on_message(std::int64_t server_time_ns, std::int64_t now_ns) {
  lower_.turn(now_ns, kNone);
  const std::int64_t bound = bounded(server_time_ns) - bounded(now_ns);
  if (upper() < bound - kToleranceNs) contradicted();
  lower_.current = std::max(lower_.current, bound);
}

void ServerClock::on_echo(std::int64_t server_time_ns, std::int64_t echoed_client_ns, std::int64_t now_ns) {
  // Checked before turn(): only a message with bounds may cause older ones to be forgotten.
  if (echoed_client_ns <= 0 || echoed_client_ns > now_ns) return;
  lower_.turn(now_ns, kNone);
  upper_.turn(now_ns, kUnbounded);
  const std::int64_t bound = bounded(server_time_ns) - bounded(echoed_client_ns);
  if (lower() != kNone && bound < lower() - kToleranceNs) contradicted();
  upper_.current = std::min(upper_.current, bound);
  lower_.current = std::max(lower_.current, bounded(server_time_ns) - bounded(now_ns));
}

std::int64_t ServerClock::lower() const { return std::max(lower_.current, lower_.previous); }
std::int64_t ServerClock::upper() const { return std::min(upper_.current, upper_.previous); }

std::int64_t ServerClock::offset_ns() const {
  if (upper() == kUnbounded || upper() < lower()) return lower();
  return lower() + (upper() - lower()) / 2;
}

std::int64_t ServerClock::round_trip_ns() const {
  if (!known() || upper() == kUnbounded) return 0;
  return std::max<std::int64_t>(0, upper() - lower());
}

void Pacer::on_delta(Frame frame, std::int64_t server_time_ns, std::int64_t now_ns) {
  const std::int64_t stamp = bounded(server_time_ns);
  clock_.on_message(stamp, now_ns);
  if (started_) {
    const double expected = static_cast<double>(frame - base_frame_) * period_ns_ + phase_ns_;
    const double late = static_cast<double>(stamp - base_ns_) - expected;
    if (frame > base_frame_ && std::abs(late) < kRestartPeriods * period_ns_) {
      phase_ns_ = late * kPhaseGain;
      jitter_ns_ += (std::abs(late) - jitter_ns_) * kJitterGain;
      base_ns_ += std::llround(expected);
      base_frame_ = frame;
      return;
    }
  }
  started_ = true;
  base_frame_ = frame;
  base_ns_ = stamp;
  phase_ns_ = 0;
}

double Pacer::server_frame(std::int64_t now_ns) const {
  return static_cast<double>(base_frame_) +
         (static_cast<double>(bounded(now_ns) + clock_.offset_ns() - base_ns_ - delay_ns_) - phase_ns_) /
             period_ns_;
}

double Pacer::arrived_frame(std::int64_t now_ns) const {
  const auto since = static_cast<double>(bounded(now_ns) + clock_.arrival_offset_ns() - base_ns_ - delay_ns_);
  return static_cast<double>(base_frame_) + (since - phase_ns_ - 2 * jitter_ns_) / period_ns_;
}

std::int64_t Pacer::published_ns(Frame frame) const {
  // A server may number its frames as it likes, but nothing is due beyond the range of a clock.
  constexpr double kFarNs = 1e18;
  const double ahead =
      std::clamp((static_cast<double>(frame) - static_cast<double>(base_frame_)) * period_ns_ + phase_ns_,
                 -kFarNs, kFarNs);
  return base_ns_ + std::llround(ahead) + delay_ns_;
}

std::int64_t Pacer::due_ns(Frame frame) const { return published_ns(frame) - clock_.offset_ns(); }

std::int64_t Pacer::arrival_ns(Frame frame) const { return published_ns(frame) - clock_.arrival_offset_ns(); }

}  // namespace tandem::client
