#pragma once
// Keeps what one client of a stream takes on the network within a cap.

#include <array>
#include <cstddef>
#include <cstdint>

#include "sdk/wire/port.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/outgoing/delta_collector.hpp"
#include "services/host/streams/frame_budget.hpp"

namespace tandem::host {

/// Says how large the next frame of a stream may be, so that an observer of it takes at most the cap, by the
/// transport's formula, in any two seconds: deltas with their headers, answers, and what is sent in any case.
/// Half of the room is for all frames alike; the other half may be spent when it is needed, as after a rest.
/// Bounded memory; not thread-safe.
class WireCap {
 public:
  struct Stream {
    std::uint32_t cap_kbit_s = 0;  ///< not 0
    std::int64_t delay_ns = 0;     ///< for which its frames are collected
    std::int64_t period_ns = 0;    ///< nominal time between two frames
  };
  static constexpr std::uint64_t kFieldBytes = DeltaCollector::kFieldBytes;

  /// Messages with deltas in a second, if no frame is large.
  [[nodiscard]] static double messages_per_s(const Stream& stream);
  /// The port must outlive it. Asserts a cap.
  WireCap(const Stream& stream, const transport::ServerPort& port);
  /// The smallest cap that has room for the headers of such a stream and for a little payload; kbit/s.
  [[nodiscard]] static std::uint32_t least_kbit_s(const Stream& stream, const transport::ServerPort& port);

  /// What the frame that is made at `now_ns` may take. `held`: what was made and not told yet.
  [[nodiscard]] FrameBudget next(const DeltaCollector::Held& held, std::int64_t now_ns) const;
  /// A frame was made, with so much payload. Times must not decrease from call to call.
  void made(std::size_t payload_bytes, std::int64_t now_ns);
  /// So many messages with deltas were queued, of so many bytes with their fields.
  void told(std::uint64_t messages, std::uint64_t bytes, std::int64_t now_ns);
  /// True if the cap has room for one message beyond those that the delay calls for.
  [[nodiscard]] bool has_room(const DeltaCollector::Held& held, std::int64_t now_ns) const;

 private:
  // Two seconds, and something for messages that leave later than they were queued.
  static constexpr std::int64_t kBinNs = 20 * kMillisecond, kWindowNs = 2'040 * kMillisecond;
  static constexpr std::size_t kBins = kWindowNs / kBinNs + 1;
  struct Bin {
    std::int64_t number = -1;  // of the time
    std::uint64_t messages = 0, bytes = 0;
    double above = 0;  // payload beyond what every frame may take
  };
  /// Of the last window.
  struct Sums {
    double messages = 0, bytes = 0, above = 0;
  };

  [[nodiscard]] Bin& bin(std::int64_t now_ns);
  [[nodiscard]] Sums sums(std::int64_t now_ns) const;
  /// Bytes on the network in a window with such deltas.
  [[nodiscard]] double wire(double messages, double bytes) const;
  /// Payload that is left in the window for the frame at hand and those that wait with it.
  [[nodiscard]] double left(const Sums& sums, const DeltaCollector::Held& held) const;

  const transport::ServerPort* port_;
  double limit_bytes_;        // of a window
  double frames_;             // of a message, by the delay alone
  double fields_in_message_;  // bytes of what a message has besides payloads
  double messages_;           // of a window, by the delay alone
  double room_bytes_;         // payload of a window
  double steady_bytes_;       // payload that every frame may take
  std::array<Bin, kBins> bins_{};
};

/// A stream of a session as WireCap has to know it.
[[nodiscard]] WireCap::Stream capped(const transport::SessionMessage& session,
                                     const transport::StreamMessage& stream);

}  // namespace tandem::host
