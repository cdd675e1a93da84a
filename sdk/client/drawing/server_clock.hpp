#pragma once
// Estimates the server's clock and the frame that the server is at.

#include <cstdint>
#include <limits>

#include "sdk/core/lattice/state.hpp"

namespace tandem::client {

/// Estimates offset = server wall clock - client steady clock from one-way stamps. A delta that arrived
/// proves offset >= sent - received. An echo of this client's clock proves offset <= server time - echoed.
/// The truth lies between; the estimate is the middle, as in NTP. Bounds are forgotten after two to four
/// seconds, those of echoes when a newer one has come, so that the estimate follows the drift between the two
/// clocks. They are forgotten at once if they contradict each other, because a clock was set.
class ServerClock {
 public:
  /// How long one set of bounds is collected. A shorter time follows drift more closely, a longer one filters
  /// delay better.
  static constexpr std::int64_t kSpanNs = 2'000'000'000;

  void on_message(std::int64_t server_time_ns, std::int64_t now_ns);
  void on_echo(std::int64_t server_time_ns, std::int64_t echoed_client_ns, std::int64_t now_ns);
  void reset() { *this = ServerClock(); }

  [[nodiscard]] bool known() const { return lower() != kNone; }
  [[nodiscard]] std::int64_t offset_ns() const;
  /// The offset of the fastest delivery: the true offset if delivery took no time.
  [[nodiscard]] std::int64_t arrival_offset_ns() const { return lower(); }
  /// Minimum time from an acknowledgement to a reply that echoes it; 0 while unknown.
  [[nodiscard]] std::int64_t round_trip_ns() const;

 private:
  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::min();
  static constexpr std::int64_t kUnbounded = std::numeric_limits<std::int64_t>::max();
  /// The bound of this span and of the one before.
  struct Bound {
    std::int64_t current = 0, previous = 0;
    std::int64_t turned_ns = kNone;
    void turn(std::int64_t now_ns, std::int64_t none);
  };
  void contradicted();
  [[nodiscard]] std::int64_t lower() const;
  [[nodiscard]] std::int64_t upper() const;

  Bound lower_{.current = kNone, .previous = kNone};
  Bound upper_{.current = kUnbounded, .previous = kUnbounded};
};

/// Estimates the frame that the server is at, as a fraction, from the times at which it published deltas. It
/// follows the server's rate, drift and jitter. A suspension or a change of rate restarts the estimate.
class Pacer {
 public:
  explicit Pacer(double frame_rate_hz) : period_ns_(1e9 / frame_rate_hz) {}

  /// Frames are published up to so long after they were made. All estimates are as if each waited for that
  /// long, so that what is drawn goes on evenly.
  void set_delay(std::int64_t delay_ns) { delay_ns_ = delay_ns; }
  [[nodiscard]] std::int64_t delay_ns() const { return delay_ns_; }

  /// `server_time_ns`: when the frame, the last of its delta, was made.
  void on_delta(Frame frame, std::int64_t server_time_ns, std::int64_t now_ns);
  void on_echo(std::int64_t server_time_ns, std::int64_t echoed_client_ns, std::int64_t now_ns) {
    clock_.on_echo(server_time_ns, echoed_client_ns, now_ns);
  }
  [[nodiscard]] bool known() const { return started_; }
  /// The server publishes frame f when this reaches f.
  [[nodiscard]] double server_frame(std::int64_t now_ns) const;
  /// Frame f is expected to have arrived when this reaches f. It is behind server_frame by the delivery and
  /// the jitter.
  [[nodiscard]] double arrived_frame(std::int64_t now_ns) const;
  /// Client time at which the server publishes `frame`.
  [[nodiscard]] std::int64_t due_ns(Frame frame) const;
  /// Client time at which `frame` arrives, without jitter.
  [[nodiscard]] std::int64_t arrival_ns(Frame frame) const;
  [[nodiscard]] double jitter_ms() const { return jitter_ns_ / 1e6; }
  [[nodiscard]] const ServerClock& clock() const { return clock_; }
  [[nodiscard]] double period_ns() const { return period_ns_; }

 private:
  /// By the server's clock.
  [[nodiscard]] std::int64_t published_ns(Frame frame) const;

  double period_ns_;
  ServerClock clock_;
  bool started_ = false;
  std::int64_t delay_ns_ = 0;
  // Anchor: frame base_frame_ is made at base_ns_ + phase_ns_. The two are separate so that doubles stay
  // exact.
  Frame base_frame_ = 0;
  std::int64_t base_ns_ = 0;
  double phase_ns_ = 0;
  double jitter_ns_ = 0;
};

}  // namespace tandem::client
