#include "services/host/outgoing/wire_cap.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {
namespace {

// The cap is kept within 5 %. Less is aimed at, as headers are computed.
constexpr double kAimed = 1.01;
constexpr double kBytesPerKbit = 1000.0 / 8;
// Of what is left beyond the steady share of each frame, one frame takes so much: a burst is told within a
// few frames, and a second one finds something left.
constexpr double kBurstShare = 0.25;
// A cap has room for so much payload in a frame, or in a message of several.
constexpr double kLeastPayload = 64;
// Length and hash of each of several frames in a message: idl/PROTOCOL.md, "Several frames".
constexpr double kFrameBytes = 11;

double bytes_per_s(const transport::ServerPort& port, double messages, double bytes) {
  return std::max(port.observer_bytes_per_s(messages, bytes), bytes);
}

// Frames are collected for the whole delay: DeltaCollector::take().
std::int64_t frames_in_message(const WireCap::Stream& stream) {
  return stream.delay_ns / stream.period_ns + 1;
}

double fields_in_message(const WireCap::Stream& stream) {
  const std::int64_t frames = frames_in_message(stream);
  return WireCap::kFieldBytes + (frames > 1 ? kFrameBytes * static_cast<double>(frames) : 0);
}

}  // namespace

double WireCap::messages_per_s(const Stream& stream) {
  return 1e9 / static_cast<double>(frames_in_message(stream) * stream.period_ns);
}

WireCap::WireCap(const Stream& stream, const transport::ServerPort& port)
    : port_(&port),
      limit_bytes_(kAimed * 2 * kBytesPerKbit * stream.cap_kbit_s),
      frames_(static_cast<double>(frames_in_message(stream))),
      fields_in_message_(fields_in_message(stream)),
      messages_(std::ceil(1e-9 * kWindowNs * messages_per_s(stream)) + 1) {
  TANDEM_ASSERT(stream.cap_kbit_s > 0 && stream.period_ns > 0);
  room_bytes_ = std::max(0.0, limit_bytes_ - wire(messages_, messages_ * fields_in_message_));
  // What is collected counts as well as what was told in the window.
  const auto frames =
      static_cast<double>(kWindowNs + stream.delay_ns) / static_cast<double>(stream.period_ns);
  steady_bytes_ = room_bytes_ / 2 / frames;
}

std::uint32_t WireCap::least_kbit_s(const Stream& stream, const transport::ServerPort& port) {
  // As in a window, so that what is not refused has room there.
  const double window_s = 1e-9 * kWindowNs;
  const double messages = std::ceil(window_s * messages_per_s(stream)) + 1;
  const double bytes =
      window_s * bytes_per_s(port, messages / window_s,
                             messages * (fields_in_message(stream) + kLeastPayload) / window_s);
  return static_cast<std::uint32_t>(std::ceil(bytes / (kAimed * 2 * kBytesPerKbit)));
}

double WireCap::wire(double messages, double bytes) const {
  constexpr double kWindowS = 1e-9 * kWindowNs;
  return kWindowS * bytes_per_s(*port_, messages / kWindowS, bytes / kWindowS);
}

WireCap::Bin& WireCap::bin(std::int64_t now_ns) {
  const std::int64_t number = now_ns / kBinNs;
  Bin& at = bins_[static_cast<std::size_t>(number) % kBins];
  if (at.number != number) at = {.number = number};
  return at;
}

WireCap::Sums WireCap::sums(std::int64_t now_ns) const {
  const std::int64_t first = now_ns / kBinNs - static_cast<std::int64_t>(kBins) + 1;
  Sums sums;
  for (const Bin& bin : bins_) {
    if (bin.number < first) continue;
    sums.messages += static_cast<double>(bin.messages);
    sums.bytes += static_cast<double>(bin.bytes);
    sums.above += bin.above;
  }
  return sums;
}

double WireCap::left(const Sums& sums, const DeltaCollector::Held& held) const {
  const double all = std::max(sums.messages + 1, messages_);
  const double fields = (all - sums.messages) * fields_in_message_;
  // The fields of those that wait are in their bytes.
  const double counted = frames_ > 1 ? kFrameBytes * std::min(frames_, static_cast<double>(held.frames)) : 0;
  return limit_bytes_ - wire(all, sums.bytes + static_cast<double>(held.bytes) + fields - counted);
}

FrameBudget WireCap::next(const DeltaCollector::Held& held, std::int64_t now_ns) const {
  const Sums now = sums(now_ns);
  const double burst = std::max(0.0, room_bytes_ / 2 - now.above);
  const double most = std::min(steady_bytes_ + kBurstShare * burst, std::max(0.0, left(now, held)));
  return {.most = static_cast<std::size_t>(most), .fair = static_cast<std::size_t>(2 * steady_bytes_) + 1};
}

void WireCap::made(std::size_t payload_bytes, std::int64_t now_ns) {
  bin(now_ns).above += std::max(0.0, static_cast<double>(payload_bytes) - steady_bytes_);
}

void WireCap::told(std::uint64_t messages, std::uint64_t bytes, std::int64_t now_ns) {
  Bin& at = bin(now_ns);
  at.messages += messages;
  at.bytes += bytes;
}

bool WireCap::has_room(const DeltaCollector::Held& held, std::int64_t now_ns) const {
  const Sums now = sums(now_ns);
  return now.messages + 2 <= messages_ || left({now.messages + 1, now.bytes, 0}, held) > 0;
}

WireCap::Stream capped(const transport::SessionMessage& session, const transport::StreamMessage& stream) {
  return {.cap_kbit_s = stream.cap_kbit_s,
          .delay_ns = stream.delay_ms * kMillisecond,
          .period_ns = period_ns_of(session.frame_rate_hz)};
}

}  // namespace tandem::host
