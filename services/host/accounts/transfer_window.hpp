#pragma once
// Decides how much of a snapshot may be on its way to one receiver, and how fast it leaves.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::accounts {

/// Bytes in flight that fill a link of unknown rate, delay, jitter and loss, and leave the queues in front of
/// it to the deltas.
///
/// The window follows the rate at which parts arrive, as in BBR (Cardwell et al. 2016), not their delay and
/// not their loss: DDS delivers in order, so one lost packet delays all behind it by a round trip, and jitter
/// changes every delay. The rate is the maximum of those seen lately, which such pauses do not lower. Not
/// thread-safe.
class TransferWindow {
 public:
  /// Sent before anything is known; it takes a quarter of a second on a link of 256 kbit/s.
  static constexpr std::size_t kFirst = 7'800;
  static constexpr std::size_t kLeast = 2'600;
  static constexpr std::size_t kMaxBytes = 4U << 20U;  ///< 1 Gbit/s at 30 ms from sending to acknowledgement
  /// Maximum queue of a full link.
  static constexpr std::int64_t kQueueNs = 100 * kMillisecond;

  /// Recorded for each part that is sent. The caller hands it back when the part has arrived.
  struct Sent {
    std::int64_t at_ns = 0;
    std::size_t bytes = 0;
    std::uint64_t arrived = 0;            // bytes, by then
    std::int64_t arrived_ns = 0;          // when the last of them was acknowledged
    std::int64_t last_arrived_at_ns = 0;  // when the last of them had been sent
  };

  /// Call whenever parts may be sent. A caller that seldom calls, such as a server whose frames take long,
  /// may catch up by the time between two calls.
  void look(std::int64_t now_ns) {
    if (now_ns == looked_ns_) return;
    behind_ns_ = looked_ns_ == 0 ? kBurstNs : std::clamp(now_ns - looked_ns_, kBurstNs, kMaxBehindNs);
    looked_ns_ = now_ns;
  }
  /// True if a part of this size may be sent in addition to those in flight.
  [[nodiscard]] bool admits(std::size_t bytes, std::int64_t now_ns) const {
    if (!within_limit(now_ns)) return false;
    return flying_ == 0 || (flying_ + bytes <= bytes_ && now_ns >= next_ns_);
  }
  /// Bytes a second that are sent at most, whatever the link takes; 0: no limit. The first parts keep it,
  /// too.
  void limit(double bytes_per_s) { limit_ = bytes_per_s; }
  /// True if the limit admits a part now.
  [[nodiscard]] bool within_limit(std::int64_t now_ns) const { return limit_ <= 0 || now_ns >= next_ns_; }
  /// When the pace admits the next part. The result may be in the past, and has no meaning while the window
  /// is full.
  [[nodiscard]] std::int64_t next_ns() const { return next_ns_; }
  [[nodiscard]] bool is_full(std::size_t bytes) const { return flying_ > 0 && flying_ + bytes > bytes_; }

  [[nodiscard]] Sent sent(std::size_t bytes, std::int64_t now_ns) {
    if (flying_ == 0) {  // nothing could arrive, so the time until now says nothing
      arrived_ns_ = now_ns;
      last_arrived_at_ns_ = now_ns;
    }
    flying_ += bytes;
    const double pace = limit_ > 0 && (pace_ <= 0 || pace_ > limit_) ? limit_ : pace_;
    if (pace > 0) {
      const std::int64_t from_ns = std::max(next_ns_, now_ns - behind_ns_);
      next_ns_ = from_ns + static_cast<std::int64_t>(static_cast<double>(bytes) / pace * 1e9);
    }
    return {now_ns, bytes, arrived_, arrived_ns_, last_arrived_at_ns_};
  }
  /// The part is not waited for any more.
  void lost(const Sent& part) {
    TANDEM_ASSERT(part.bytes <= flying_);
    flying_ -= part.bytes;
  }
  /// Parts of this total size were acknowledged together; `last` is the one that was sent last.
  void arrived(std::size_t bytes, const Sent& last, std::int64_t now_ns) {
    TANDEM_ASSERT(bytes <= flying_);
    flying_ -= bytes;
    follow_train(bytes, last, now_ns);
    arrived_ += bytes;
    arrived_ns_ = now_ns;
    last_arrived_at_ns_ = std::max(last_arrived_at_ns_, last.at_ns);
    least_ns_ = std::min(least_ns_, std::max<std::int64_t>(now_ns - last.at_ns, 1));
    saw_rate(static_cast<std::size_t>(arrived_ - last.arrived),
             std::max(now_ns - last.arrived_ns, last.at_ns - last.last_arrived_at_ns), now_ns);
    resize();
  }
  /// Call if nothing has arrived for long: the rate of the link is unknown now.
  void start_over() {
    rates_ = {};
    starting_ = true;
    bytes_ = kLeast;
    pace_ = 0;
    least_ns_ = INT64_MAX;
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  /// Minimum time from sending to acknowledgement; 0: nothing has arrived yet.
  [[nodiscard]] std::int64_t least_ns() const { return least_ns_ == INT64_MAX ? 0 : least_ns_; }

 private:
  static constexpr double kStartGain = 2.9;  // BBR's 2/ln 2: twice the rate each round trip
  static constexpr std::int64_t kBurstNs = 5 * kMillisecond;
  static constexpr std::int64_t kMaxBehindNs = kSecond;
  // Acknowledgements come 20 ms apart; two that jitter moved together must not pass for a fast link.
  static constexpr std::int64_t kLeastGapNs = 10 * kMillisecond;
  static constexpr std::size_t kTrain = 5'200;  // bytes: four parts
  static constexpr std::int64_t kRateLastsNs = kSecond;

  // Parts that were on their way together arrive at the rate of the link. Two or three are not enough: a
  // token bucket on the way, or acknowledgements queued together, make two parts appear at once on any link.
  void follow_train(std::size_t bytes, const Sent& last, std::int64_t now_ns) {
    if (arrived_ > 0 && last.at_ns < train_ns_) {
      train_bytes_ += bytes;
      if (train_bytes_ < kTrain) return;
      saw_rate(train_bytes_, std::max(now_ns - train_ns_, last.at_ns - train_at_ns_), now_ns);
      starting_ = false;
    }
    train_bytes_ = 0;
    train_ns_ = now_ns;
    train_at_ns_ = last.at_ns;
  }

  void saw_rate(std::size_t bytes, std::int64_t within_ns, std::int64_t now_ns) {
    const double rate =
        static_cast<double>(bytes) * 1e9 / static_cast<double>(std::max(within_ns, kLeastGapNs));
    // The maximum of this span and the last one.
    if (now_ns - span_ns_ >= kRateLastsNs) {
      rates_ = {now_ns - span_ns_ < 2 * kRateLastsNs ? rates_[1] : 0, 0};
      span_ns_ = now_ns;
    }
    rates_[1] = std::max(rates_[1], rate);
  }
  [[nodiscard]] double rate() const { return std::max(rates_[0], rates_[1]); }

  void resize() {
    const auto least_s = static_cast<double>(least_ns_) * 1e-9;
    const double full = rate() * (least_s + static_cast<double>(kQueueNs) * 1e-9);
    const double wanted = starting_ ? std::max(full, kStartGain * rate() * least_s) : full;
    const auto least = static_cast<double>(starting_ ? kFirst : kLeast);
    bytes_ = static_cast<std::size_t>(std::clamp(wanted, least, static_cast<double>(kMaxBytes)));
    pace_ = static_cast<double>(bytes_) / least_s;
  }

  std::size_t bytes_ = kFirst;
  std::size_t flying_ = 0;
  double pace_ = 0;  // bytes a second; 0: none
  double limit_ = 0;
  std::int64_t next_ns_ = INT64_MIN;
  std::int64_t looked_ns_ = 0;
  std::int64_t behind_ns_ = kBurstNs;
  std::uint64_t arrived_ = 0;
  std::int64_t arrived_ns_ = 0;
  std::int64_t last_arrived_at_ns_ = 0;
  std::size_t train_bytes_ = 0;  // that arrived since
  std::int64_t train_ns_ = 0;
  std::int64_t train_at_ns_ = 0;  // when what arrived then had been sent
  std::int64_t least_ns_ = INT64_MAX;
  std::array<double, 2> rates_{};  // bytes a second
  std::int64_t span_ns_ = 0;
  bool starting_ = true;  // the rate of the link is still unknown
};

/// What a snapshot to a client may take of its cap: what the deltas leave, and a quarter of the cap at least.
/// In bytes a second of parts of `part_bytes`, each of which costs `other_bytes` more with its headers and
/// answers. 0: there is no cap.
[[nodiscard]] constexpr double limit_under_cap(std::uint32_t cap_kbit_s, double deltas_bytes_per_s,
                                               double part_bytes, double other_bytes) {
  const double cap_bytes_per_s = cap_kbit_s * 1000.0 / 8;
  const double left = std::max(cap_bytes_per_s / 4, cap_bytes_per_s - deltas_bytes_per_s);
  return cap_kbit_s == 0 ? 0 : left * part_bytes / (part_bytes + other_bytes);
}

}  // namespace tandem::accounts
