// What a running simulation's frames put into a checkpoint, and take from one.

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "services/host/frames/live_source.hpp"

namespace tandem::host {

void LiveSource::capture(checkpoint::Checkpoint& out) const {
  TANDEM_ASSERT(!cycle_.stepping());
  out.session = session_.session;
  out.scene = session_.scene;
  out.engine = engine_;
  out.program = TANDEM_VERSION;
  out.epoch = session_.epoch;
  out.frame = frame();
  out.dt_s = session_.dt_s;
  out.lattice_unit = session_.lattice_unit;
  out.gravity = simulation_->gravity();
  out.damping_per_s = simulation_->damping_per_s();
  out.bodies = mirror_.target().alive_count();
  out.types.clear();
  for (const transport::BodyType& type : session_.types) out.types.push_back(type.name);
  mirror_.save(out.next_reuse, out.withheld);
  out.streams.clear();
  for (std::uint32_t id = 0; id < lanes_.size() && encodes(id); ++id) {
    const transport::StreamMessage& told = session_.streams[id];
    // A stream that is not made yet keeps what it had learned.
    out.streams.push_back({lanes_[id].config.name, told.layout_hash, told.id.generation,
                           lanes_[id].learned.value_or(parameters(id))});
  }
  out.last_input = last_input_;
  out.scheduled.clear();
  for (const Waiting& waiting : scheduled_)
    out.scheduled.push_back({waiting.drive.number, waiting.drive.frame, waiting.input});
  out.immediate = immediate_;
  out.later = later_;
  out.world.clear();
  out.waiting_news.clear();
  if (news_) news_->save(out.world, out.waiting_news);
  out.engine_state.clear();
  simulation_->save(out.engine_state);
}

Result<void> LiveSource::go_on_from(const checkpoint::Checkpoint& checkpoint) {
  last_input_ = checkpoint.last_input;
  immediate_ = checkpoint.immediate;
  later_ = checkpoint.later;
  if (news_ && !checkpoint.world.empty()) {
    if (auto good = news_->restore(checkpoint.world, checkpoint.waiting_news); !good) return good;
  }
  for (const checkpoint::Scheduled& waiting : checkpoint.scheduled) {
    const engine::Classification effect = simulation_->classify(waiting.input);
    const auto drive = to_drive(lanes_.front().config.lattice, effect.gravity, effect.damping_per_s);
    if (effect.effect != engine::Classification::Effect::kScheduled || !drive)
      return fail(ErrorCode::kMalformed, "the simulation refuses an input of the checkpoint");
    scheduled_.push_back(
        {{.number = waiting.number, .frame = waiting.frame, .drive = *drive}, waiting.input});
  }
  return {};
}

void LiveSource::remember_parameters(const checkpoint::Checkpoint& checkpoint) {
  for (std::uint32_t id = 0; id < lanes_.size() && encodes(id); ++id) {
    const auto known =
        std::ranges::find(checkpoint.streams, lanes_[id].config.name, &checkpoint::StreamState::name);
    // With another layout, what was learned may be of another codec or lattice.
    if (known == checkpoint.streams.end() || known->layout_hash != session_.streams[id].layout_hash) continue;
    if (lanes_[id].stream) {
      lanes_[id].stream->resume(known->parameters);
    } else {
      lanes_[id].learned = known->parameters;
    }
  }
}

}  // namespace tandem::host
