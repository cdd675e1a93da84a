#include "services/host/outgoing/publication.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/parcels.hpp"

namespace tandem::host {
Publication::Publication(const transport::SessionMessage& session, const transport::ServerPort& port)
    : epoch_(session.epoch),
      budgets_(session.streams.size()),
      sent_(session.streams.size()),
      told_(session.streams.size()) {
  for (const transport::StreamMessage& stream : session.streams) {
    collectors_.emplace_back(DeltaCollector::Limits{
        .frames = transport::max_earlier(session.capacity) + 1,
        .bytes = std::min<std::size_t>(DeltaCollector::kMaxBytes, stream.max_delta_bytes),
        .delay_ns = stream.delay_ms * kMillisecond,
        .period_ns = period_ns_of(session.frame_rate_hz)});
    caps_.emplace_back();
    if (stream.cap_kbit_s > 0) caps_.back().emplace(capped(session, stream), port);
  }
}

std::span<const FrameBudget> Publication::budgets(std::int64_t now_ns) {
  for (std::size_t stream = 0; stream < caps_.size(); ++stream)
    if (caps_[stream]) budgets_[stream] = caps_[stream]->next(collectors_[stream].held(), now_ns);
  return budgets_;
}

void Publication::push(Outbox& outbox, const MadeFrame& frame, const Stamp& stamp) {
  TANDEM_ASSERT(outbox.has_frame_room(1));  // the caller's thread is the only producer
  const bool hurries = frame.hurries && stamp.now_ns - hurried_ns_ >= kHurryNs;
  if (hurries) hurried_ns_ = stamp.now_ns;
  for (const MadeDelta& made : frame.deltas) {
    TANDEM_ASSERT(made.payload.size() <= transport::kMaxDeltaBytes && made.stream < sent_.size());
    std::optional<WireCap>& cap = caps_[made.stream];
    if (cap) cap->made(made.payload.size(), stamp.now_ns);
    DeltaCollector::Held held = collectors_[made.stream].held();
    held.bytes += made.payload.size();
    const bool may_hurry = !cap || cap->has_room(held, stamp.now_ns);
    collectors_[made.stream].take({.frame = frame.frame,
                                   .hash = made.hash,
                                   .last_input = frame.last_input,
                                   .wall_ns = stamp.wall_ns,
                                   .payload = made.payload,
                                   .at_once = (hurries && may_hurry) || made.at_once},
                                  stamp.now_ns, leaving_);
    push_leaving(outbox, made.stream, stamp.now_ns);
  }
  static_cast<void>(outbox.push(EndOfFrame{}));
}

void Publication::push_collected(Outbox& outbox, bool all, std::int64_t now_ns) {
  TANDEM_ASSERT(outbox.has_frame_room(1));
  bool any = false;
  for (std::uint32_t stream = 0; stream < sent_.size(); ++stream) {
    collectors_[stream].release(all, now_ns, leaving_);
    any = any || !leaving_.empty();
    push_leaving(outbox, stream, now_ns);
  }
  if (any) static_cast<void>(outbox.push(EndOfFrame{}));
}

void Publication::push_leaving(Outbox& outbox, std::uint32_t stream, std::int64_t now_ns) {
  for (transport::DeltaMessage& delta : leaving_) {
    delta.epoch = epoch_;
    delta.stream.id = stream;
    sent_[stream].add(delta.frame, now_ns);
    delta.parts =
        static_cast<std::uint32_t>(transport::part_count(delta.payload.size(), transport::kPartBytes));
    TANDEM_ASSERT(delta.parts == 1 || delta.earlier == 0);
    const std::uint64_t told_bytes = delta.payload.size() + std::uint64_t{delta.parts} * WireCap::kFieldBytes;
    told_[stream].messages += delta.parts;
    told_[stream].bytes += told_bytes;
    if (caps_[stream]) caps_[stream]->told(delta.parts, told_bytes, now_ns);
    if (delta.parts == 1) {
      static_cast<void>(outbox.push(std::move(delta)));
      continue;
    }
    const transport::Bytes payload = std::exchange(delta.payload, {});
    for (; delta.part < delta.parts; ++delta.part) {
      const auto bytes = transport::part_of(payload, transport::kPartBytes, delta.part);
      delta.payload.assign(bytes.begin(), bytes.end());
      static_cast<void>(outbox.push(delta));
    }
  }
  leaving_.clear();
}

}  // namespace tandem::host
