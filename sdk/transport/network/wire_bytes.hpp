#pragma once
// The bytes that messages take on the network, as IPv4 packets with all headers. They are computed, because
// DDS does not count them.
// Sizes: idl/PROTOCOL.md, "Bytes on the wire". tests/bench/wire/wire.py compares with an interface's
// counters.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace tandem::transport {

/// Over DDS, as Cyclone DDS packs it.
struct DdsWire {
  static constexpr std::uint64_t kIpBytes = 20, kUdpBytes = 8;
  /// RTPS header, INFO_TS and DATA; a reliable writer appends a heartbeat.
  static constexpr std::uint64_t kSampleBytes = kIpBytes + kUdpBytes + 20 + 12 + 24, kHeartbeatBytes = 32;
  static constexpr std::uint64_t kAnswerBytes = 92;  ///< a reader's acknowledgement
  static constexpr std::uint64_t kLifeBytes = 80;    ///< a writer that shows life
  static constexpr std::uint64_t kPacketBytes = 1480;
  /// Heartbeat intervals. A reader answers a writer's sample that comes later than 0.8 of this after the last
  /// answer.
  static constexpr std::int64_t kServerHeartbeatMs = 300, kClientHeartbeatMs = 100;
  static constexpr std::int64_t kServerAsksNs = 800'000 * kServerHeartbeatMs,
                                kClientAsksNs = 800'000 * kClientHeartbeatMs;
  /// A writer that shows life does so after this silence: with a lease of 1 s one sign may be lost.
  static constexpr std::int64_t kShowsLifeNs = 400'000'000;
  /// Interval at which DDS participants are announced.
  static constexpr int kAnnouncedS = 15;

  /// Bytes a second of what two DDS participants send each other in any case: announcements, and automatic
  /// signs of life with their answers, the server's every 3.2 s. `own_life_s`: the client's interval.
  static constexpr double in_any_case(double own_life_s) {
    constexpr double kAnnouncements = 460 + 444, kLife = 144 + kAnswerBytes, kServerLifeS = 3.2;
    return kAnnouncements / kAnnouncedS + kLife / kServerLifeS + kLife / own_life_s;
  }
  /// `bytes`: of the sample, with its encapsulation header.
  static constexpr std::uint64_t sample(std::size_t bytes, bool reliable) {
    const std::uint64_t datagram = kSampleBytes - kIpBytes + (reliable ? kHeartbeatBytes : 0) + bytes;
    return datagram + kIpBytes * (1 + datagram / kPacketBytes);
  }
  /// Bytes a second of one observer of a stream: deltas, answers, signs of life, and what is sent now and
  /// then. `messages` and `bytes` are those of deltas in a second.
  static double of_observer(double messages, double bytes) {
    // Acknowledgement and reply with their answers each ten seconds, figures each twenty.
    constexpr double kNowAndThen = in_any_case(8) + (200 + 184 + 2 * kAnswerBytes) / 10.0 + 320 / 20.0;
    if (messages <= 0) return kNowAndThen + kLifeBytes / (1e-9 * kShowsLifeNs);
    const double gap_ns = 1e9 / messages;
    const double answers = messages / std::max(1.0, std::ceil(kServerAsksNs / gap_ns));
    const double lives = std::floor(gap_ns / kShowsLifeNs) * messages;
    const double datagram = bytes / messages + (kSampleBytes + kHeartbeatBytes - kIpBytes);
    const double further = messages * std::floor(datagram / kPacketBytes) * kIpBytes;
    return kNowAndThen + bytes + further + messages * static_cast<double>(kSampleBytes + kHeartbeatBytes) +
           answers * kAnswerBytes + lives * kLifeBytes;
  }
};

/// Counts of one DDS participant's samples in both directions. Thread-safe.
class DdsWireCount {
 public:
  /// A sample that came or went; `last_answer_ns` is the writer's or reader's own, for answers.
  void sample(std::size_t bytes, bool reliable, std::int64_t asks_ns, std::int64_t now_ns,
              std::int64_t& last_answer_ns) {
    std::uint64_t all = DdsWire::sample(bytes, reliable);
    if (reliable && now_ns - last_answer_ns >= asks_ns) {
      all += DdsWire::kAnswerBytes;
      last_answer_ns = now_ns;
    }
    bytes_.fetch_add(all, std::memory_order_relaxed);
  }
  /// A writer that shows life was silent for so long.
  void silence(std::int64_t gap_ns) {
    constexpr std::int64_t kLongestNs = 10'000'000'000;  // more is a link that was lost
    const std::int64_t signs = std::clamp<std::int64_t>(gap_ns, 0, kLongestNs) / DdsWire::kShowsLifeNs;
    bytes_.fetch_add(static_cast<std::uint64_t>(signs) * DdsWire::kLifeBytes, std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> bytes_ = 0;
};

/// A WebSocket message of so many bytes, over TCP, with the answer to it; TLS takes 22 more.
[[nodiscard]] constexpr std::uint64_t websocket_wire_bytes(std::size_t bytes) {
  constexpr std::uint64_t kFrame = 4, kTcpBytes = 52, kAnswerBytes = 26, kSegmentBytes = 1448;
  const std::uint64_t segments = 1 + (bytes + kFrame) / kSegmentBytes;
  return bytes + kFrame + segments * (kTcpBytes + kAnswerBytes);
}

}  // namespace tandem::transport
