#include "sdk/client/drawing/picture_writer.hpp"

namespace tandem::client {

PictureWriter::PictureWriter(PictureExchange& exchange, const transport::SessionMessage& session)
    : exchange_(exchange),
      picture_{.epoch = session.epoch,
               .lattice_unit = session.lattice_unit,
               .pacer = Pacer(session.frame_rate_hz)} {}

void PictureWriter::on_loaded(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns) {
  jumps_.assign(timeline.state(timeline.applied()).capacity(), 0);
  accelerations_.forget(jumps_.size());
  is_loaded_anew_ = true;
  Picture next = picture_;
  show_agreed(next, timeline, pacer, now_ns);
}

void PictureWriter::on_applied(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns) {
  if (!follows()) return;
  for (const LifecycleRecord& record : timeline.lifecycle()) {
    const bool moved = record.kind == LifecycleKind::kSpawn || record.kind == LifecycleKind::kTeleport;
    if (moved) ++jumps_[record.slot];
  }
  Picture next = picture_;
  next.before = next.agreed;
  show_agreed(next, timeline, pacer, now_ns);
}

void PictureWriter::on_changed(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns) {
  if (!follows()) return;
  Picture next = picture_;
  show_agreed(next, timeline, pacer, now_ns);
}

void PictureWriter::on_simulated(const ClientTimeline& timeline, const Pacer& pacer) {
  if (!follows() || is_loaded_anew_) return;
  Picture next = picture_;
  draw_ahead(timeline, next);
  show(next, pacer);
}

void PictureWriter::on_clock(const Pacer& pacer) {
  if (follows()) show(picture_, pacer);
}

void PictureWriter::show_agreed(Picture& next, const ClientTimeline& timeline, const Pacer& pacer,
                                std::int64_t now_ns) {
  // A snapshot may be older than what was drawn: the picture stays until the deltas behind it caught up.
  if (follows() && timeline.applied() < picture_.agreed->frame) return;
  if (is_loaded_anew_) {
    next.load = exchange_.count_load();
    next.before = nullptr;
  }
  accelerations_.gravity = timeline.drive().gravity;
  const State& state = instead_ != nullptr ? *instead_ : timeline.state(timeline.applied());
  next.agreed = draw(state, timeline.applied(), next);
  next.agreed_ns = now_ns;
  draw_ahead(timeline, next);
  show(next, pacer);
  is_loaded_anew_ = false;
}

void PictureWriter::draw_ahead(const ClientTimeline& timeline, Picture& next) {
  const bool is_ahead = timeline.now() > timeline.applied() && instead_ == nullptr;
  if (is_ahead)
    accelerations_.learn(timeline.state(timeline.now() - 1), timeline.state(timeline.now()),
                         timeline.drive().gravity);
  next.ahead = is_ahead ? draw(timeline.state(timeline.now()), timeline.now(), next) : next.agreed;
}

const DrawnFrame* PictureWriter::draw(const State& state, Frame frame, const Picture& next) {
  DrawnFrame& drawn = exchange_.unused(next);
  client::draw(state, frame, jumps_, accelerations_, drawn);
  return &drawn;
}

void PictureWriter::show(const Picture& next, const Pacer& pacer) {
  picture_ = next;
  picture_.pacer = pacer;
  exchange_.show(picture_);
}

}  // namespace tandem::client
