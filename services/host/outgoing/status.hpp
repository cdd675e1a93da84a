#pragma once
// Publishes a stream's figures once a second, for any DDS monitor.

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "sdk/statistics/duration_histogram.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/outgoing/report.hpp"

namespace tandem::host {

/// Turns counts since the start into rates of the last second. Not thread-safe.
class StatusDesk {
 public:
  /// Outbox and port must outlive it.
  StatusDesk(std::string session, std::uint32_t stream, Epoch epoch, Outbox& outbox,
             const transport::ServerPort& port)
      : session_(std::move(session)), stream_(stream), epoch_(epoch), outbox_(&outbox), port_(&port) {}

  void start(std::int64_t now_ns) { started_ns_ = second_ns_ = now_ns; }
  void frame_took(std::int64_t duration_ns) { durations_.add(duration_ns); }

  /// Of the last figures.
  [[nodiscard]] double mbit_per_s() const { return mbit_per_s_; }

  /// Time between two figures, while the stream is made and while it is not.
  static constexpr std::int64_t kPeriodNs = kSecond, kIdlePeriodNs = 5 * kSecond;

  /// What one observer of the stream took on the network in the last second in which it was made; 0: unknown.
  [[nodiscard]] double wire_mbit_per_s() const { return wire_mbit_per_s_; }
  [[nodiscard]] bool due(std::int64_t now_ns) const { return now_ns >= next_ns_; }
  /// Somebody new waits for the figures: those of a stream that is not made come as soon as others.
  void hurry() { next_ns_ = std::min(next_ns_, second_ns_ + kPeriodNs); }
  /// The state at the moment.
  struct Present {
    Frame frame = 0;
    std::uint32_t bodies = 0, at_rest = 0, participants = 0, observers = 0, window = 0;
    std::uint32_t raw_body_bytes = 0;  ///< what one body's channels take uncompressed
    bool made = true;  ///< the stream is made now; if not, the figures of the last second in which it
                       ///< was made stay
    double estimated_mbit_per_s = 0;  ///< of a stream that is not made, if it was measured; else 0
    double messages_per_s = 0;        ///< with deltas of small frames, at the nominal frame rate
    double threshold_m = 0;           ///< in force
    std::string_view codec, predictor;
  };
  /// Publishes the figures. If the outbox has no room, the figures of this second are lost.
  void publish(const HostTotals& totals, const Present& present, std::int64_t now_ns);

 private:
  std::string session_;
  std::uint32_t stream_;
  Epoch epoch_;
  Outbox* outbox_;
  const transport::ServerPort* port_;
  std::int64_t started_ns_ = 0, next_ns_ = 0;
  // The totals and the time of the last status.
  HostTotals second_;
  std::int64_t second_ns_ = 0;
  DurationHistogram durations_;  // durations since the last status
  double mbit_per_s_ = 0, wire_mbit_per_s_ = 0, corrected_per_frame_ = 0, threshold_m_ = 0;
};

}  // namespace tandem::host
