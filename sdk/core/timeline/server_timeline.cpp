#include <algorithm>
#include <utility>

#include "sdk/core/data/data_queue.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/core/timeline/input_schedule.hpp"
#include "sdk/core/timeline/parts.hpp"
#include "sdk/core/timeline/snapshot.hpp"
#include "sdk/core/timeline/stopwatch.hpp"
#include "sdk/core/timeline/timeline.hpp"

namespace tandem {

struct ServerTimeline::Impl {
  // There is room for so many lifecycle records from the start. Room for one of every slot would take more
  // memory than the state.
  static constexpr std::size_t kUsualRecords = 1024;

  Impl(TimelineParts made, const Layout& layout, Epoch the_epoch, StreamId the_stream)
      : parts(std::move(made)),
        epoch(the_epoch),
        stream(the_stream),
        state(layout.capacity, groups_of(layout)),
        ledger(layout.capacity),
        queue(layout.capacity),
        payload(parts.delta.bound(kUsualRecords)) {
    state.keep_for_predictor(parts.predictor->own_bytes());
    hash = parts.hash(state, ledger);
  }

  // Writes the frame's news where the payload begins, and applies them.
  void tell(std::span<const std::byte> bytes) {
    if (bytes.empty()) return;
    TANDEM_ASSERT(parts.world.has_value());
    std::copy(bytes.begin(), bytes.end(), payload.begin());
    const auto rest = read_news(bytes, parts.features, state.capacity(), news);
    TANDEM_ASSERT(rest && rest->empty());
    parts.world->apply(news);
  }

  // Chooses the frame's data and applies them. Returns the section's body.
  std::span<const std::byte> tell(const DataTarget& target, const BodyData::Lives& lives) {
    if (!parts.data) return {};
    std::span<const std::byte> body;
    if (target.records.empty()) {
      parts.data->keep();
    } else {
      body = queue.next(*parts.data, target.records, lives, target.most_bytes);
    }
    parts.data->apply(lives);
    return body;
  }

  TimelineParts parts;
  Epoch epoch;
  StreamId stream;
  Frame frame = 0;
  State state;
  BlockLedger ledger;  // of `state`
  DataQueue queue;
  Drive drive;
  InputSchedule inputs;
  std::uint64_t hash = 0;
  std::vector<std::byte> payload;
  News news;  // kept to reuse its memory
  Stopwatch::Clock clock = nullptr;
};

Result<ServerTimeline> ServerTimeline::create(const Layout& layout, Epoch epoch, const LocalOptions& local,
                                              StreamId stream) {
  auto predictor = make_predictor(layout.predictor, layout.capacity, layout.predictor_constants);
  if (!predictor) return tl::unexpected<Error>(predictor.error());
  return create(layout, epoch, std::move(*predictor), local, stream);
}

Result<ServerTimeline> ServerTimeline::create(const Layout& layout, Epoch epoch,
                                              std::unique_ptr<Predictor> predictor, const LocalOptions& local,
                                              StreamId stream) {
  auto parts = make_parts(layout, local, std::move(predictor));
  if (!parts) return tl::unexpected<Error>(parts.error());
  return ServerTimeline(std::make_unique<Impl>(std::move(*parts), layout, epoch, stream));
}

ServerTimeline::ServerTimeline(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ServerTimeline::ServerTimeline(ServerTimeline&&) noexcept = default;
ServerTimeline& ServerTimeline::operator=(ServerTimeline&&) noexcept = default;
ServerTimeline::~ServerTimeline() = default;

void ServerTimeline::start(Frame frame, const State& state, const Drive& drive, std::uint64_t last_input,
                           std::span<const ScheduledDrive> pending, const SessionWorld* world,
                           std::span<const std::byte> data) {
  TANDEM_ASSERT(state.capacity() == impl_->state.capacity() && state.groups() == impl_->state.groups() &&
                valid_drive(drive));
  impl_->frame = frame;
  impl_->state = state;
  impl_->state.keep_for_predictor(impl_->parts.predictor->own_bytes());
  impl_->drive = drive;
  impl_->inputs.reset(last_input, pending);
  if (impl_->parts.world) impl_->parts.world = world != nullptr ? *world : SessionWorld();
  if (std::optional<BodyData>& own = impl_->parts.data) {
    const std::vector<std::byte> nothing(data.empty() ? own->records().size() : 0);
    own->start(data.empty() ? std::span(nothing) : data, state.alive());
  }
  impl_->ledger.renew_all(impl_->parts.new_number());
  impl_->hash = impl_->parts.hash(impl_->state, impl_->ledger);
}

Result<void> ServerTimeline::schedule(const ScheduledDrive& input) {
  if (input.number != impl_->inputs.held_to() + 1) {
    return fail(ErrorCode::kOutOfOrder, "scheduled inputs are numbered without gaps");
  }
  if (!valid_drive(input.drive)) return fail(ErrorCode::kInvalidArgument, "gravity out of range");
  const auto added = impl_->inputs.add(input, impl_->frame);
  if (!added) return tl::unexpected<Error>(added.error());
  return {};
}

ServerTimeline::FrameResult ServerTimeline::advance(const State& target,
                                                    std::span<const LifecycleRecord> lifecycle,
                                                    std::size_t budget, EncodeObserver* observer,
                                                    BlockNumbers target_numbers,
                                                    std::span<const std::byte> news, const DataTarget& data) {
  Impl& m = *impl_;
  TANDEM_ASSERT(target_numbers.empty() || target_numbers.size() == m.ledger.numbers.size());
  FrameResult result;
  Stopwatch watch(m.clock);
  ++m.frame;
  const Vec3i gravity_before = m.drive.gravity;
  m.drive = m.inputs.drive_for(m.frame, m.drive);
  m.inputs.forget(m.frame);
  m.parts.step(m.state, m.ledger, m.state, m.ledger, m.parts.step_input(m.drive, gravity_before));
  result.predict_ns = watch.lap_ns();
  m.parts.delta.set_gravity(m.drive.gravity);
  const std::span<const std::byte> told = m.tell(data, {target.alive(), lifecycle});
  result.data_bytes = told.empty() ? 0 : section_bytes(told.size());
  result.data_waiting = m.queue.waiting();
  const std::size_t others = news.size() + result.data_bytes;
  if (const std::size_t bound = others + m.parts.delta.bound(lifecycle.size()); bound > m.payload.size())
    m.payload.resize(bound);
  m.tell(news);
  if (!told.empty()) {
    ByteWriter out(std::span(m.payload).subspan(news.size()));
    put_section(SectionType::kData, out, [&](ByteWriter& body) { body.put_bytes(told); });
  }
  const DeltaCodec::Encoded encoded =
      m.parts.delta.encode(m.state, target, lifecycle, budget, std::span(m.payload).subspan(others), observer,
                           {.predicted = m.ledger.numbers, .target = target_numbers});
  m.ledger.renew_blocks_of(m.parts.delta.touched(), m.parts.new_number());
  result.encode_ns = watch.lap_ns();
  m.hash = m.parts.hash(m.state, m.ledger);
  result.hash_ns = watch.lap_ns();
  result.frame = m.frame;
  result.last_input = m.inputs.held_to();
  result.hash = m.hash;
  result.payload = std::span<const std::byte>(m.payload).first(others + encoded.size_bytes);
  result.correction_bytes = encoded.correction_bytes;
  result.corrected = encoded.corrected;
  return result;
}

void ServerTimeline::set_clock(std::int64_t (*now_ns)()) { impl_->clock = now_ns; }
void ServerTimeline::set_parameters(const StreamParameters& parameters) {
  impl_->parts.delta.set_parameters(parameters);
}
void ServerTimeline::round_next() { impl_->parts.delta.round_next(); }
Frame ServerTimeline::frame() const { return impl_->frame; }
const State& ServerTimeline::state() const { return impl_->state; }
const Drive& ServerTimeline::drive() const { return impl_->drive; }
const StreamParameters& ServerTimeline::parameters() const { return impl_->parts.delta.parameters(); }
const BodyData* ServerTimeline::data() const { return impl_->parts.extras().data; }
const Predictor& ServerTimeline::predictor() const { return *impl_->parts.predictor; }
void ServerTimeline::watch_pushes() { impl_->parts.predictor->watch_pushes(); }
std::uint64_t ServerTimeline::hash() const { return impl_->hash; }
std::uint64_t ServerTimeline::last_input() const { return impl_->inputs.held_to(); }
std::size_t ServerTimeline::payload_bound() const {
  return impl_->parts.delta.bound() + (impl_->parts.world ? kMaxNewsBytes : 0) +
         (impl_->parts.data ? impl_->parts.data->bytes_bound() : 0);
}

void ServerTimeline::snapshot(std::vector<std::byte>& out, std::optional<StreamId> as) {
  const auto pending = impl_->inputs.pending();
  const Snapshot snapshot{.epoch = impl_->epoch,
                          .stream = as.value_or(impl_->stream),
                          .frame = impl_->frame,
                          .last_input = impl_->inputs.held_to(),
                          .drive = impl_->drive,
                          .parameters = impl_->parts.delta.parameters(),
                          .hash = impl_->hash,
                          .leaves_hash = impl_->parts.hasher.leaves_hash(),
                          .pending = {pending.begin(), pending.end()}};
  write_snapshot(snapshot, impl_->state, impl_->parts.delta.codec(), out, impl_->parts.extras());
}

std::size_t ServerTimeline::snapshot_bound() const {
  return snapshot_bytes_bound(impl_->state, impl_->parts.delta.codec(), impl_->parts.extras());
}

}  // namespace tandem
