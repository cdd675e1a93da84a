#include "sdk/client/picture_writer.hpp"

#include <cstddef>

namespace tandem::client {

PictureWriter::PictureWriter(PictureExchange& exchange, const transport::SessionMessage& session)
    : exchange_(exchange),
      picture_{.epoch = session.epoch,
               .lattice_unit = session.lattice_unit,
               .pacer = Pacer(session.frame_rate_hz)} {}

void PictureWriter::on_loaded(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns) {
  if (!exchange_.wanted()) return;
  jumps_.assign(timeline.state(timeline.applied()).capacity(), 0);
  accelerations_.forget(jumps_.size());
  picture_.load = exchange_.count_load();
  picture_.before = nullptr;
  picture_.agreed = draw_agreed(timeline);
  picture_.agreed_ns = now_ns;
  draw_ahead(timeline);
  show(pacer);
}

void PictureWriter::on_applied(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns) {
  if (!follows()) return;
  for (const LifecycleRecord& record : timeline.lifecycle()) {
    const bool moved = record.kind == LifecycleKind::kSpawn || record.kind == LifecycleKind::kTeleport;
    if (moved) ++jumps_[record.slot];
  }
  picture_.before = picture_.agreed;
  picture_.agreed = draw_agreed(timeline);
  picture_.agreed_ns = now_ns;
  draw_ahead(timeline);
  show(pacer);
}

void PictureWriter::on_simulated(const ClientTimeline& timeline, const Pacer& pacer) {
  if (!follows()) return;
  draw_ahead(timeline);
  show(pacer);
}

void PictureWriter::on_clock(const Pacer& pacer) {
  if (follows()) show(pacer);
}

void PictureWriter::draw_ahead(const ClientTimeline& timeline) {
  const bool is_ahead = timeline.now() > timeline.applied() && instead_ == nullptr;
  if (is_ahead)
    accelerations_.learn(timeline.state(timeline.now() - 1), timeline.state(timeline.now()),
                         timeline.drive().gravity);
  picture_.ahead = is_ahead ? draw(timeline.state(timeline.now()), timeline.now()) : picture_.agreed;
}

const DrawnFrame* PictureWriter::draw_agreed(const ClientTimeline& timeline) {
  accelerations_.gravity = timeline.drive().gravity;
  return draw(instead_ != nullptr ? *instead_ : timeline.state(timeline.applied()), timeline.applied());
}

const DrawnFrame* PictureWriter::draw(const State& state, Frame frame) {
  DrawnFrame& drawn = exchange_.unused(picture_);
  client::draw(state, frame, jumps_, accelerations_, drawn);
  return &drawn;
}

void PictureWriter::show(const Pacer& pacer) {
  picture_.pacer = pacer;
  exchange_.show(picture_);
}

}  // namespace tandem::client
