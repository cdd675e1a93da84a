#include <algorithm>
#include <string>
#include <utility>

#include "sdk/core/data/data_section.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/core/timeline/input_schedule.hpp"
#include "sdk/core/timeline/parts.hpp"
#include "sdk/core/timeline/snapshot.hpp"
#include "sdk/core/timeline/stopwatch.hpp"
#include "sdk/core/timeline/timeline.hpp"

namespace tandem {

struct ClientTimeline::Impl {
  // A frame in the ring, and the input of the step that produced it.
  struct Held {
    State state;
    StepInput input;
    BlockLedger ledger;  // of `state`
  };

  Impl(TimelineParts made, const Layout& layout)
      : parts(std::move(made)), type_count(layout.type_count), max_lead(layout.lead) {
    // With lead 0 the next frame still needs a place while its delta is being checked.
    Held held{State(layout.capacity, groups_of(layout)), {}, BlockLedger(layout.capacity)};
    held.state.keep_for_predictor(parts.predictor->own_bytes());
    ring.assign(std::max<std::size_t>(2, max_lead + 1U), held);
  }

  Held& at(Frame frame) { return ring[frame % ring.size()]; }

  Result<void> check_next(Frame frame, std::uint64_t last_input) const {
    if (!playing) return fail(ErrorCode::kOutOfOrder, "no snapshot loaded");
    if (frame != applied + 1) {
      return fail(ErrorCode::kOutOfOrder,
                  "delta " + std::to_string(frame) + " does not follow " + std::to_string(applied));
    }
    if (last_input > inputs.held_to()) {
      return fail(ErrorCode::kOutOfOrder,
                  "scheduled inputs up to " + std::to_string(last_input) + " are not all here");
    }
    return {};
  }

  void simulate(Frame frame) {
    TANDEM_ASSERT(!unread && applied < frame && frame < applied + ring.size());
    const Held& before = at(frame - 1);
    Held& next = at(frame);
    next.input = parts.step_input(inputs.drive_for(frame, before.input.drive), before.input.drive.gravity);
    step(before, next);
  }
  void step(const Held& before, Held& next) {
    parts.step(before.state, before.ledger, next.state, next.ledger, next.input);
  }

  // Checks the news that a payload begins with, and returns what stands behind them.
  Result<std::span<const std::byte>> read_news(std::span<const std::byte> payload) {
    if (!parts.world) return payload;
    auto rest = tandem::read_news(payload, parts.features, at(applied).state.capacity(), news);
    if (!rest) return rest;
    if (auto fits = parts.world->check(news); !fits) return tl::unexpected<Error>(fits.error());
    return rest;
  }

  // Checks a frame's data. `delta`: of the same payload, checked; `before`: the frame's state without it.
  Result<void> read_data(const std::optional<std::span<const std::byte>>& section, const Delta& delta,
                         const State& before) {
    if (!parts.data) return {};
    list_living(before.alive(), delta.lifecycle, alive);
    if (section) return parts.data->decode(*section, {alive, delta.lifecycle});
    parts.data->keep();
    return {};
  }

  // Call after a delta changed the touched slots of the frame just applied, and perhaps the inputs of the
  // steps after it.
  void resimulate() {
    const std::span<const Slot> touched = parts.delta.touched();
    for (Frame frame = applied + 1; frame <= simulated; ++frame) {
      Held& next = at(frame);
      const StepInput input = parts.step_input(next.input.drive, next.input.gravity_before);
      const bool stepped_otherwise = next.input != input;
      next.input = input;
      if (touched.empty() && !stepped_otherwise) continue;
      if (stepped_otherwise || parts.predictor->interacts()) {
        step(at(frame - 1), next);
      } else {
        parts.predictor->step_slots(at(frame - 1).state, next.state, next.input, touched);
        next.ledger.renew_blocks_of(touched, parts.new_number());
      }
    }
  }

  TimelineParts parts;
  TypeId type_count;
  std::uint32_t max_lead;
  std::vector<Held> ring;  // frames applied .. simulated, by frame modulo size
  Epoch epoch = 0;
  StreamId stream;
  Frame applied = 0;
  Frame now = 0;
  Frame simulated = 0;  // now, or the prepared frame beyond it
  bool playing = false;
  bool unread = false;  // deltas were passed: the ring has no state of `applied`
  InputSchedule inputs;
  News news;                        // of the last apply()
  std::vector<std::uint8_t> alive;  // with data: of the frame that is applied
  std::uint64_t hash = 0;
  Timings timings;
  Stopwatch::Clock clock = nullptr;
};

Result<ClientTimeline> ClientTimeline::create(const Layout& layout, const LocalOptions& local) {
  auto predictor = make_predictor(layout.predictor, layout.capacity, layout.predictor_constants);
  if (!predictor) return tl::unexpected<Error>(predictor.error());
  return create(layout, std::move(*predictor), local);
}

Result<ClientTimeline> ClientTimeline::create(const Layout& layout, std::unique_ptr<Predictor> predictor,
                                              const LocalOptions& local) {
  auto parts = make_parts(layout, local, std::move(predictor));
  if (!parts) return tl::unexpected<Error>(parts.error());
  return ClientTimeline(std::make_unique<Impl>(std::move(*parts), layout));
}

ClientTimeline::ClientTimeline(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ClientTimeline::ClientTimeline(ClientTimeline&&) noexcept = default;
ClientTimeline& ClientTimeline::operator=(ClientTimeline&&) noexcept = default;
ClientTimeline::~ClientTimeline() = default;

Result<void> ClientTimeline::load(std::span<const std::byte> snapshot, Epoch epoch, StreamId stream) {
  Impl& m = *impl_;
  m.playing = false;
  // Loads beside the state that is drawn meanwhile; the frames simulated beyond it are dropped.
  m.now = m.simulated = m.applied;
  Impl::Held& place = m.at(m.applied + 1);
  State& state = place.state;
  place.ledger.renew_all(m.parts.new_number());
  m.news = {};
  auto read = read_snapshot(snapshot, m.type_count, state, m.parts.delta.codec(), m.parts.features,
                            m.parts.data ? &*m.parts.data : nullptr);
  if (!read) return tl::unexpected<Error>(read.error());
  if (read->epoch != epoch) return fail(ErrorCode::kOutOfOrder, "snapshot of another epoch");
  if (read->stream != stream) return fail(ErrorCode::kOutOfOrder, "snapshot of another stream");
  if (!list_the_same(read->parameters, m.parts.delta.parameters()))
    return fail(ErrorCode::kMalformed, "snapshot with other parameters than the stream lists");
  const std::uint64_t hash = m.parts.hash(state, place.ledger, read->world, m.parts.data);
  if (hash != read->hash || m.parts.hasher.leaves_hash() != read->leaves_hash) {
    return fail(ErrorCode::kMismatch,
                "snapshot says " + to_hex(read->hash) + ", its state is " + to_hex(hash));
  }
  std::swap(place, m.at(read->frame));
  m.at(read->frame).input.drive = read->drive;
  m.parts.delta.restore_parameters(read->parameters);
  m.parts.world = std::move(read->world);
  m.inputs.reset(read->last_input, read->pending);
  m.epoch = read->epoch;
  m.stream = read->stream;
  m.applied = m.now = m.simulated = read->frame;
  m.hash = hash;
  m.playing = true;
  m.unread = false;
  return {};
}

bool ClientTimeline::playing() const { return impl_->playing; }

Result<void> ClientTimeline::schedule(const ScheduledDrive& input) {
  Impl& m = *impl_;
  if (!m.playing) return fail(ErrorCode::kOutOfOrder, "no snapshot loaded");
  const auto added = m.inputs.add(input, m.applied);
  if (!added) return tl::unexpected<Error>(added.error());
  if (*added) {
    for (Frame frame = input.frame; frame <= m.simulated; ++frame) m.simulate(frame);
  }
  return {};
}

std::uint64_t ClientTimeline::inputs_held() const { return impl_->inputs.held_to(); }

Result<void> ClientTimeline::apply(Frame frame, std::uint64_t last_input, std::uint64_t hash,
                                   std::span<const std::byte> payload) {
  Impl& m = *impl_;
  if (auto good = m.check_next(frame, last_input); !good) return good;
  if (m.unread) return fail(ErrorCode::kOutOfOrder, "the deltas before were not read");
  Stopwatch watch(m.clock);
  if (m.simulated == m.applied) m.simulate(m.simulated = frame);
  m.timings.predict_ns = watch.lap_ns();
  auto& [state, input, ledger] = m.at(frame);
  m.parts.delta.set_gravity(input.drive.gravity);
  auto rest = m.read_news(payload);
  if (!rest) return tl::unexpected<Error>(rest.error());
  Result<std::optional<std::span<const std::byte>>> data = std::nullopt;
  if (m.parts.data) data = take_data(*rest);
  if (!data) return tl::unexpected<Error>(data.error());
  const auto delta = m.parts.delta.decode(state, *rest, {.predicted = ledger.numbers, .target = {}});
  if (!delta) return tl::unexpected<Error>(delta.error());
  if (auto good = m.read_data(*data, *delta, state); !good) return good;
  if (m.parts.world) m.parts.world->apply(m.news);
  if (m.parts.data) m.parts.data->apply({m.alive, delta->lifecycle});
  m.parts.delta.apply(*delta, state);
  ledger.renew_blocks_of(m.parts.delta.touched(), m.parts.new_number());
  m.applied = frame;
  m.now = std::max(m.now, frame);
  m.inputs.forget(frame);
  m.timings.decode_ns = watch.lap_ns();
  m.hash = m.parts.hash(state, ledger);
  m.timings.hash_ns = watch.lap_ns();
  TANDEM_ASSERT(m.applied <= m.now && m.now <= m.simulated && m.simulated < m.applied + m.ring.size());
  m.resimulate();
  m.timings.predict_ns += watch.lap_ns();
  if (m.hash != hash) {
    return fail(ErrorCode::kMismatch, "frame " + std::to_string(frame) + " is " + to_hex(m.hash) +
                                          ", the server has " + to_hex(hash));
  }
  return {};
}

Result<void> ClientTimeline::pass(Frame frame, std::uint64_t last_input, std::uint64_t hash) {
  Impl& m = *impl_;
  if (auto good = m.check_next(frame, last_input); !good) return good;
  m.applied = m.now = m.simulated = frame;
  m.inputs.forget(frame);
  m.hash = hash;
  m.news = {};
  m.unread = true;
  m.timings = {};
  return {};
}

bool ClientTimeline::holds_state() const { return impl_->playing && !impl_->unread; }

void ClientTimeline::snapshot(std::vector<std::byte>& out) const {
  const Impl& m = *impl_;
  TANDEM_ASSERT(m.playing && !m.unread);
  Snapshot snapshot{.epoch = m.epoch,
                    .stream = m.stream,
                    .frame = m.applied,
                    .last_input = m.inputs.held_to(),
                    .drive = drive(),
                    .parameters = parameters(),
                    .hash = m.hash,
                    .leaves_hash = m.parts.hasher.leaves_hash(),
                    .pending = {}};
  // The number does not promise the inputs beyond a gap.
  for (const ScheduledDrive& input : m.inputs.pending()) {
    if (input.number <= snapshot.last_input && input.frame > m.applied) snapshot.pending.push_back(input);
  }
  write_snapshot(snapshot, state(m.applied), m.parts.delta.codec(), out, m.parts.extras());
}

void ClientTimeline::rename(Epoch epoch, StreamId stream) {
  impl_->epoch = epoch;
  impl_->stream = stream;
}

bool ClientTimeline::step(std::uint32_t lead) {
  Impl& m = *impl_;
  if (!holds_state() || m.now >= m.applied + std::min(lead, m.max_lead)) return false;
  if (++m.now > m.simulated) m.simulate(m.simulated = m.now);
  return true;
}

void ClientTimeline::prepare() {
  Impl& m = *impl_;
  if (holds_state() && m.simulated == m.applied) m.simulate(++m.simulated);
}

Frame ClientTimeline::applied() const { return impl_->applied; }
Frame ClientTimeline::now() const { return impl_->now; }
const State& ClientTimeline::state(Frame frame) const {
  TANDEM_ASSERT(impl_->applied <= frame && frame <= impl_->now);
  return impl_->at(frame).state;
}
std::uint64_t ClientTimeline::hash() const { return impl_->hash; }
const Drive& ClientTimeline::drive() const { return impl_->at(impl_->applied).input.drive; }
std::span<const Slot> ClientTimeline::touched() const { return impl_->parts.delta.touched(); }
std::span<const Slot> ClientTimeline::corrected() const { return impl_->parts.delta.corrected(); }
std::span<const LifecycleRecord> ClientTimeline::lifecycle() const { return impl_->parts.delta.lifecycle(); }
const StreamParameters& ClientTimeline::parameters() const { return impl_->parts.delta.parameters(); }
const SessionWorld* ClientTimeline::world() const { return impl_->parts.extras().world; }
const BodyData* ClientTimeline::data() const { return impl_->parts.extras().data; }
const News& ClientTimeline::news() const { return impl_->news; }
ClientTimeline::Timings ClientTimeline::timings() const { return impl_->timings; }
void ClientTimeline::set_clock(std::int64_t (*now_ns)()) { impl_->clock = now_ns; }

}  // namespace tandem
