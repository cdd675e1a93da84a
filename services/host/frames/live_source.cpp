#include "services/host/frames/live_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/plain_text.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/frames/announcement.hpp"
#include "services/host/streams/far_away.hpp"

namespace tandem::host {

using transport::Reason;

namespace {

// As clients are told of them: ascending by slot, and only of bodies that they see.
std::vector<transport::BodyName> names_of(std::vector<engine::BodyName> given, const State& shown) {
  std::ranges::stable_sort(given, {}, &engine::BodyName::slot);
  std::vector<transport::BodyName> names;
  for (const engine::BodyName& body : given) {
    if (names.size() == transport::kMaxBodyNames) break;
    if (body.slot >= shown.capacity() || shown.alive()[body.slot] == 0) continue;
    if (!names.empty() && names.back().slot == body.slot) continue;
    std::string name = transport::plain_text(body.name, transport::kMaxNameBytes);
    if (!name.empty()) names.push_back({body.slot, shown.reuse()[body.slot], std::move(name)});
  }
  return names;
}

// A stream uses more than one core only for its blocks: StreamConfig::local.
std::uint32_t threads_for(std::size_t streams) {
  return std::min(static_cast<std::uint32_t>(streams), std::max(1U, std::thread::hardware_concurrency()));
}

}  // namespace

LiveSource::LiveSource(const HostConfig& config, engine::Simulation& simulation, Mirror mirror,
                       const Drive& drive)
    : simulation_(&simulation),
      mirror_(std::move(mirror)),
      workers_(threads_for(config.streams.size())),
      session_(session_message(config)),
      frame_rate_hz_(config.frame_rate_hz),
      clock_ns_(config.clock_ns),
      cycle_(config.start_frame, config.pipeline),
      engine_(config.engine),
      has_moved_(config.goes_on_from != nullptr),
      drive_(drive),
      gravity_hint_(config.streams.front().lattice,
                    config.streams.front().layout.parameters.codec.threshold) {
  session_.gravity = simulation.gravity();
  const Layout& layout = config.streams.front().layout;
  if (layout.world.any()) news_.emplace(layout.world, layout.capacity);
  bool is_steered = false, some_must_pay = false;
  for (const StreamConfig& stream : config.streams) {
    const std::uint32_t carries = encoding_offer(config.streams, lanes_.size());
    withheld_[lanes_.size()] = stream.offered == Offered::kOnceItPays;
    some_must_pay = some_must_pay || stream.offered != Offered::kAlways;
    is_steered = is_steered || stream.quality.has_value();
    lanes_.push_back({.config = stream, .carries = carries});
  }
  // A stream that is steered to a rate takes that rate. Without pauses between frames no time is to spare.
  if (some_must_pay && !is_steered && !config.free_rate)
    trials_.emplace(encoding_offers(config.streams), config.frame_rate_hz, config.clock_ns);
}

Result<std::unique_ptr<LiveSource>> LiveSource::create(const HostConfig& config,
                                                       engine::Simulation& simulation) {
  const Lattice& lattice = config.streams.front().lattice;
  const auto drive = to_drive(lattice, simulation.gravity(), simulation.damping_per_s());
  if (!drive) return tl::unexpected(drive.error());
  auto mirror = make_mirror(config.streams, simulation.bodies(), config.extent);
  if (!mirror) return tl::unexpected(mirror.error());
  if (config.goes_on_from) mirror->restore(config.goes_on_from->next_reuse, config.goes_on_from->withheld);
  std::unique_ptr<LiveSource> source(new LiveSource(config, simulation, std::move(*mirror), *drive));
  if (config.goes_on_from) {
    if (auto good = source->go_on_from(*config.goes_on_from); !good) return tl::unexpected(good.error());
  }
  for (std::uint32_t id = 0; id < source->lanes_.size(); ++id) {
    if (!source->encodes(id)) {
      list_offer(source->lanes_[id].carries, config.streams[id].delay_ms, source->session_);
      continue;
    }
    auto stream = source->begin(id);
    const std::string& name = config.streams[id].name;
    if (!stream && name.empty()) return tl::unexpected(stream.error());
    if (!stream) return fail(stream.error().code, fmt::format("stream {}: {}", name, stream.error().message));
    list_stream(*stream, source->session_);
    if (id == 0) source->lanes_[id].stream = std::make_shared<Stream>(std::move(*stream));
  }
  if (config.goes_on_from) source->remember_parameters(*config.goes_on_from);
  source->refresh_names();
  return source;
}

Result<Stream> LiveSource::begin(std::uint32_t id) const {
  std::vector<ScheduledDrive> pending;
  for (const Waiting& waiting : scheduled_) pending.push_back(waiting.drive);
  auto stream = Stream::create(lanes_[id].config, {.mirror = mirror_,
                                                   .drive = drive_,
                                                   .epoch = session_.epoch,
                                                   .id = {.id = id, .generation = 0},
                                                   .frame = frame(),
                                                   .frame_rate_hz = frame_rate_hz_,
                                                   .last_input = last_input_,
                                                   .pending = pending,
                                                   .under_way = has_moved_,
                                                   .moved = simulation_->moved(),
                                                   .world = news_ ? &news_->world() : nullptr});
  if (stream) stream->set_clock(clock_ns_);
  return stream;
}

Result<void> LiveSource::make(std::uint32_t id) {
  auto stream = begin(id);
  if (!stream) return tl::unexpected(stream.error());
  lanes_[id].stream = std::make_shared<Stream>(std::move(*stream));
  // A stream that is begun anew later in the epoch starts with its first parameters, as always.
  if (const auto learned = std::exchange(lanes_[lanes_[id].carries].learned, std::nullopt))
    lanes_[id].stream->resume(*learned);
  return {};
}

Stream* LiveSource::played(std::uint32_t id) const {
  const auto is = [&](const Lane& lane) { return lane.stream && lane.carries == lanes_[id].carries; };
  const auto found = std::ranges::find_if(lanes_, is);
  return found == lanes_.end() ? nullptr : found->stream.get();
}

StreamSet LiveSource::active() const {
  StreamSet active;
  for (std::size_t id = 0; id < lanes_.size(); ++id) active[id] = lanes_[id].stream != nullptr;
  return active;
}

void LiveSource::set_active(StreamSet streams) {
  TANDEM_ASSERT(streams.any());
  for (std::uint32_t id = 0; id < lanes_.size(); ++id) {
    Lane& lane = lanes_[id];
    if (!streams[id] || lane.stream) continue;
    const auto same = std::ranges::find_if(lanes_, [&lane](const Lane& other) {
      return other.stream && same_encoding(other.config, lane.config);
    });
    if (same != lanes_.end()) {
      lane.stream = same->stream;
      lanes_[lane.carries].learned.reset();
      continue;
    }
    const auto made = make(id);
    TANDEM_ASSERT(made.has_value());  // it was begun before, from the same configuration
  }
  // Last, so that a stream goes on whose clients went from one of its offers to another.
  for (std::uint32_t id = 0; id < lanes_.size(); ++id)
    if (!streams[id]) lanes_[id].stream.reset();
  for (std::uint32_t id = 0; id < lanes_.size(); ++id)
    if (encodes(id) && played(id) == nullptr) lanes_[id].told_out_of_reach = false;
}

PositionError LiveSource::error_of(std::uint32_t id) const {
  if (!lanes_[id].stream) return {};
  const double unit_m = lanes_[id].config.lattice.unit;
  const PositionError units = position_error(mirror_.target(), lanes_[id].stream->agreed(), frame());
  return {.rms = units.rms * unit_m, .largest = units.largest * unit_m};
}

const StreamParameters& LiveSource::parameters(std::uint32_t id) const {
  const Stream* const stream = played(id);
  return stream != nullptr ? stream->parameters() : lanes_[id].config.layout.parameters;
}

void LiveSource::begin_next() {
  step_began_ns_ = clock();
  acts_next_ = !immediate_.empty();
  for (const Waiting& waiting : scheduled_) {
    if (waiting.drive.frame > cycle_.next_frame()) continue;
    simulation_->apply(waiting.input);
    acts_next_ = true;
  }
  for (const engine::Input& input : immediate_) simulation_->apply(input);
  immediate_ = std::exchange(later_, {});
  cycle_.begin();
  step_is_ready_ = false;
  simulation_->begin_step();
}

bool LiveSource::failed() {
  std::string why = simulation_->failure();
  if (why.empty()) return false;
  error_ = {ErrorCode::kIo, std::move(why)};
  return true;
}

bool LiveSource::take_step() {
  if (cycle_.stepping()) {
    TANDEM_ASSERT(step_is_ready_);
  } else {
    begin_next();
  }
  if (failed()) {
    cycle_.end();
    return false;
  }
  settle_inputs();
  has_moved_ = true;
  acted_ = acts_next_;
  step_ns_ = clock() - step_began_ns_;
  const engine::Bodies bodies = simulation_->bodies();
  if (auto good = mirror_.check(bodies); !good) {
    error_ = good.error();
    cycle_.end();
    return false;
  }
  mirror_.update(bodies, simulation_->events(), simulation_->moved(), lanes_.front().config.local.run_blocks);
  if (news_) {
    simulation_news_.ask(*simulation_, *news_, frame() + 1);
    news_->take(mirror_);
  }
  engine_mishaps_ = simulation_->mishaps();
  if (drive_.gravity == Vec3i{}) {
    if (std::string hint = gravity_hint_.look(mirror_.target()); !hint.empty())
      refusals_.push_back(std::move(hint));
  }
  if (hides_many()) origin_hint_ = origin_hint(bodies, mirror_.extent());
  note_births();
  cycle_.take();
  return true;
}

void LiveSource::set_budgets(std::span<const FrameBudget> budgets) {
  TANDEM_ASSERT(budgets.size() == lanes_.size());
  for (std::size_t id = 0; id < lanes_.size(); ++id) lanes_[id].budget = budgets[id];
}

// Of lanes that share a stream, the one with the least room decides.
FrameBudget LiveSource::budget_of(const Stream* stream) const {
  FrameBudget least;
  for (const Lane& lane : lanes_)
    if (lane.stream.get() == stream && lane.budget.most < least.most) least = lane.budget;
  return least;
}

std::optional<MadeFrame> LiveSource::next(StreamSet snapshots_follow, Outbox& /*outbox*/) {
  if (!cycle_.taken() && !take_step()) return std::nullopt;
  cycle_.make();
  deltas_.clear();
  for (std::uint32_t id = 0; id < lanes_.size(); ++id) {
    if (!lanes_[id].stream) continue;
    if (snapshots_follow[id]) lanes_[id].stream->round_next();
    deltas_.push_back({.stream = id});
  }
  make_deltas();
  for (const MadeDelta& made : deltas_) {
    if (made.payload.size() <= session_.streams[made.stream].max_delta_bytes) continue;
    error_ = {ErrorCode::kCapacity, "more bodies appeared in a frame than a delta can tell"};
    return std::nullopt;
  }
  return MadeFrame{.frame = frame(),
                   .last_input = last_input_,
                   .deltas = deltas_,
                   .step_ns = step_ns_,
                   .hurries = acted_ || (news_ && news_->told_events())};
}

void LiveSource::make_deltas() {
  const std::span<const std::byte> news = news_ ? news_->told() : std::span<const std::byte>();
  const auto stream_of = [this](const MadeDelta& made) { return lanes_[made.stream].stream.get(); };
  const auto first_of = [&](const MadeDelta& made) {
    return std::ranges::find_if(deltas_, [&](const MadeDelta& o) { return stream_of(o) == stream_of(made); });
  };
  workers_.run(static_cast<std::uint32_t>(deltas_.size()), 1, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t i = begin; i < end; ++i) {
      MadeDelta& made = deltas_[i];
      if (&*first_of(made) != &made) continue;
      const Stream::FrameResult frame =
          lanes_[made.stream].stream->produce(mirror_, nullptr, news, budget_of(stream_of(made)));
      made.hash = frame.hash;
      made.payload = frame.payload;
      made.corrected = frame.corrected;
      made.predict_ns = frame.predict_ns;
      made.encode_ns = frame.encode_ns;
      made.apply_ns = frame.hash_ns;
    }
  });
  for (MadeDelta& made : deltas_) {
    const MadeDelta& first = *first_of(made);
    if (&first == &made) continue;
    made = {
        .stream = made.stream, .hash = first.hash, .payload = first.payload, .corrected = first.corrected};
  }
}

std::span<const MadeDelta> LiveSource::encoded() {
  encoded_.clear();
  for (const MadeDelta& made : deltas_) {
    const std::uint32_t id = lanes_[made.stream].carries;
    if (std::ranges::find(encoded_, id, &MadeDelta::stream) != encoded_.end()) continue;
    encoded_.push_back(made);
    encoded_.back().stream = id;
  }
  std::ranges::sort(encoded_, {}, &MadeDelta::stream);
  return encoded_;
}

void LiveSource::note_births() {
  names_are_old_ = names_are_old_ || simulation_->names_version() != names_version_ ||
                   std::ranges::any_of(mirror_.lifecycle(), [](const LifecycleRecord& record) {
                     return record.kind == LifecycleKind::kSpawn;
                   });
}

transport::SessionMessage LiveSource::announced() const {
  transport::SessionMessage told = session_;
  std::erase_if(told.streams,
                [this](const transport::StreamMessage& stream) { return withheld_[stream.carries]; });
  return told;
}

void LiveSource::use_spare_time() {
  if (trials_ && !deltas_.empty())
    trials_->after_frame(mirror_, encoded(), [this](std::uint32_t id) { return begin(id); });
}

double LiveSource::estimated_mbit_per_s(std::uint32_t id) const {
  return trials_ ? mbit_per_s(trials_->bytes_per_frame(lanes_[id].carries)) : 0;
}

double LiveSource::mbit_per_s(double bytes_per_frame) const {
  return bytes_per_frame * frame_rate_hz_ * 8 / kBitsPerMbit;
}

bool LiveSource::refresh_names() {
  const bool other_streams = std::exchange(streams_are_new_, false);
  return refresh_bodies() || other_streams;
}

bool LiveSource::refresh_bodies() {
  if (!names_are_old_ || cycle_.stepping()) return false;
  names_are_old_ = false;
  names_version_ = simulation_->names_version();
  auto names = names_of(simulation_->names(), mirror_.target());
  if (names == session_.names) return false;
  session_.names = std::move(names);
  return true;
}

InputVerdict LiveSource::accept(const transport::InputMessage& message, const InputTerms& terms,
                                Outbox& outbox) {
  const engine::Input input{.kind = message.kind, .values = message.values, .bytes = message.bytes};
  const engine::Classification effect = simulation_->classify(input);
  InputVerdict verdict;
  switch (effect.effect) {
    case engine::Classification::Effect::kScheduled:
      verdict = schedule(input, effect, message, outbox);
      break;
    case engine::Classification::Effect::kImmediate:
      if (immediate_.size() >= kMaxImmediate) return {Reason::kRateLimited};
      if (too_dear(effect.cost, message.client, terms))
        return {Reason::kRateLimited, 0, "the budget of pushes is used up"};
      immediate_.push_back(input);
      verdict = {Reason::kNone, cycle_.next_frame()};
      break;
    case engine::Classification::Effect::kRefused:
      note_refusal(message, effect.reason);
      verdict = {Reason::kInvalid, 0, transport::plain_text(effect.reason, transport::kMaxReplyTextBytes)};
      break;
  }
  if (verdict.reason == Reason::kNone && message.client != 0) senders_.sent(message.client, terms.now_ns);
  return verdict;
}

bool LiveSource::too_dear(double cost, transport::ClientId client, const InputTerms& terms) {
  constexpr std::int64_t kTellNs = 10 * kSecond;
  if (terms.budget == nullptr) return false;
  const engine::InputBudget rule = simulation_->input_budget();
  if (terms.budget->take(cost, {rule.per_second, rule.most}, terms.now_ns)) return false;
  if (terms.now_ns - told_budget_ns_ >= kTellNs) {
    told_budget_ns_ = terms.now_ns;
    refusals_.push_back(fmt::format(
        "client {:016x} has used up its budget of pushes (push_budget), so its next pushes are refused",
        client));
  }
  return true;
}

InputVerdict LiveSource::schedule(const engine::Input& input, const engine::Classification& effect,
                                  const transport::InputMessage& message, Outbox& outbox) {
  const auto drive = to_drive(lanes_.front().config.lattice, effect.gravity, effect.damping_per_s);
  if (!drive)
    return {Reason::kInvalid, 0, transport::plain_text(drive.error().message, transport::kMaxReplyTextBytes)};
  // s + A: no client can have simulated it, because none is further than A beyond delta s - 1.
  const Frame frame = cycle_.next_frame() + session_.lead;
  if (scheduling_frame_ != frame) scheduled_now_ = 0;
  if (scheduled_now_ >= kMaxScheduledPerFrame || !outbox.has_control_room()) return {Reason::kRateLimited};
  if (scheduled_.size() >= kMaxPendingInputs) return {Reason::kRateLimited};
  const ScheduledDrive scheduled{.number = last_input_ + 1, .frame = frame, .drive = *drive};
  for (auto lane = lanes_.begin(); lane != lanes_.end(); ++lane) {
    const bool is_first = std::ranges::find(lanes_.begin(), lane, lane->stream, &Lane::stream) == lane;
    // If one stream refuses an input, all do: they hold the same inputs, and the drive is checked above.
    if (lane->stream && is_first && !lane->stream->schedule(scheduled)) return {Reason::kInvalid};
  }
  if (trials_) trials_->schedule(scheduled);
  ++last_input_;
  scheduling_frame_ = frame;
  ++scheduled_now_;
  scheduled_.push_back({scheduled, input});
  TANDEM_ASSERT(scheduled_.size() < 2 ||
                scheduled_[scheduled_.size() - 2].drive.frame <= frame);  // by frame, as by number
  const bool queued = outbox.push(transport::ScheduledInputMessage{
      .epoch = session_.epoch,
      .number = scheduled.number,
      .frame = frame,
      .source_client = message.client,
      .source_number = message.number,
      .kind = static_cast<std::uint32_t>(transport::ScheduledKind::kDrive),
      .values = {drive->gravity[0], drive->gravity[1], drive->gravity[2], drive->damping}});
  TANDEM_ASSERT(queued);  // there was room, and no other thread pushes
  return {Reason::kNone, frame, {}, scheduled.number};
}

Result<void> LiveSource::set_parameters(std::uint32_t id, const StreamParameters& parameters) {
  Stream* const stream = played(id);
  if (stream == nullptr) return fail(ErrorCode::kOutOfOrder, "nobody plays this stream");
  return stream->set_parameters(parameters);
}

void LiveSource::note_refusal(const transport::InputMessage& message, const std::string& reason) {
  if (refusals_.size() >= kMaxRefusals || message.client == 0) return;
  refusals_.push_back(fmt::format("the simulation refuses input {} of client {:016x}: {}", message.number,
                                  message.client, reason));
}

std::vector<std::string> LiveSource::take_notices(std::int64_t /*now_ns*/) {
  std::vector<std::string> lines = std::exchange(refusals_, {});
  for (std::uint32_t id = 0; id < lanes_.size(); ++id) {
    const Stream* const stream = played(id);
    if (!encodes(id) || stream == nullptr) continue;
    note_target(lanes_[id], *stream, lines);
    note_crowded(lanes_[id], *stream, lines);
  }
  if (trials_ && trials_->take_end()) judge_trials(lines);
  return lines;
}

std::vector<std::string> LiveSource::take_warnings(std::int64_t now_ns) {
  std::vector<std::string> lines;
  note_mishaps(now_ns, lines);
  note_hidden(now_ns, lines);
  if (auto line = simulation_news_.take_warning(now_ns)) lines.push_back(std::move(*line));
  return lines;
}

void LiveSource::note_mishaps(std::int64_t now_ns, std::vector<std::string>& lines) {
  engine::Mishaps now = engine_mishaps_;
  now.clamped += mirror_.mishaps().clamped;
  if (now == noted_mishaps_ || now_ns - noted_mishaps_ns_ < kSecond) return;
  noted_mishaps_ns_ = now_ns;
  const std::uint64_t lost = now.removed - noted_mishaps_.removed;
  const std::string who = lost > 0 ? fmt::format("; {} of them since the last such line, up to frame {}; {}",
                                                 lost, frame(), blamed(now_ns))
                                   : std::string();
  noted_mishaps_ = now;
  const auto slowed = mirror_.last_slowed();
  const std::string turned =
      slowed ? fmt::format("; the last one that turned too fast: slot {}", *slowed) : "";
  lines.push_back(
      fmt::format("the simulation has faulty bodies: {} removed and {} slowed down since its start{}{}",
                  now.removed, now.clamped, who, turned));
}

void LiveSource::note_hidden(std::int64_t now_ns, std::vector<std::string>& lines) {
  const std::uint32_t hidden = mirror_.hidden();
  const std::uint64_t removed = mirror_.mishaps().removed;
  const bool due = now_ns - told_hidden_ns_ >= kTellHiddenNs;
  const bool others = hidden > 0 && removed != told_removed_, back = hidden == 0 && told_hidden_ > 0;
  // A few lines until all are hidden, and else one in ten seconds.
  if (!hides_many() && !(due && (others || back))) return;
  told_hidden_ns_ = now_ns;
  told_hidden_ = hidden;
  told_removed_ = removed;
  if (back) return lines.emplace_back("all bodies are shown to clients again"), void();
  lines.push_back(fmt::format(
      "{} of {} bodies are not shown to clients until they are whole and within the extent again; "
      "the last: {} in frame {}; {}{}",
      hidden, hidden + mirror_.target().alive_count(), mirror_.last_hidden(), frame(), blamed(now_ns),
      std::exchange(origin_hint_, {})));
}

std::string LiveSource::blamed(std::int64_t now_ns) {
  const std::string names = senders_.names(now_ns);
  return names.empty() ? "no client sent an input in the 10 s before"
                       : "inputs of the 10 s before came from " + names;
}

void LiveSource::note_target(Lane& lane, const Stream& stream, std::vector<std::string>& lines) {
  const bool out_of_reach = stream.target_out_of_reach();
  if (out_of_reach == lane.told_out_of_reach) return;
  lane.told_out_of_reach = out_of_reach;
  const StreamConfig& of = lane.config;
  const std::string which = of.name.empty() ? std::string() : " of stream " + of.name;
  const double most_m = of.quality->largest_threshold * of.lattice.unit;
  if (of.cap_kbit_s > 0) {
    const std::string cap = fmt::format("the cap of {} kbit/s{}", of.cap_kbit_s, which);
    lines.push_back(out_of_reach
                        ? fmt::format("{} leaves errors above the maximum threshold, {:.3g} m", cap, most_m)
                        : cap + " holds nothing back any more");
    return;
  }
  const std::string target = fmt::format("the target of {} Mbit/s{}", of.quality->target_mbit_per_s, which);
  lines.push_back(out_of_reach
                      ? fmt::format("{} is exceeded even at the maximum threshold, {:.3g} m", target, most_m)
                      : target + " is kept again");
}

BodyCounts LiveSource::bodies(std::uint32_t id) const {
  BodyCounts counts = FrameSource::bodies(id);
  counts.crowded = made(id).crowded();
  return counts;
}

// A heap has some crowded cells; with many, the predicted step is hardly better than none.
void LiveSource::note_crowded(Lane& lane, const Stream& stream, std::vector<std::string>& lines) const {
  constexpr std::uint32_t kShare = 8;  // one body in so many
  const std::uint32_t crowded = stream.crowded();
  if (lane.told_crowded || kShare * crowded < stream.bodies() || crowded == 0) return;
  lane.told_crowded = true;
  const auto largest = std::ranges::max_element(session_.types, {}, &transport::BodyType::radius);
  lines.push_back(fmt::format(
      "predictor '{}'{} lets {} of {} bodies pass through others, which costs bits: its cells are as wide as the largest "
      "type, '{}', and take few bodies each. Make that body part of the scenery, or take predictor 'ballistic'",
      lane.config.layout.predictor, lane.config.name.empty() ? "" : " of stream " + lane.config.name, crowded,
      stream.bodies(), largest->name));
}

std::string LiveSource::called(std::uint32_t id) const {
  return fmt::format("{} ({})", lanes_[id].config.name, lanes_[id].config.layout.predictor);
}

void LiveSource::judge_trials(std::vector<std::string>& lines) {
  constexpr double kWorthwhile = 0.75;  // of the bytes of the best that clients are told of
  const double reference = trials_->reference_bytes();
  // Of what is offered, and of what every client can play.
  double best = reference, always = std::numeric_limits<double>::infinity();
  if (lanes_[trials_->reference()].config.offered == Offered::kAlways) always = reference;
  std::string told =
      fmt::format("stream {} takes {:.3g} Mbit/s", called(trials_->reference()), mbit_per_s(reference));
  for (std::uint32_t id = 0; id < lanes_.size() && encodes(id); ++id) {
    const double bytes = trials_->bytes_per_frame(id);
    if (trials_->too_slow(id)) told += fmt::format(", {} would take too much time here", called(id));
    if (bytes <= 0 || played(id) != nullptr) continue;
    told += fmt::format(", {} would take {:.3g}", called(id), mbit_per_s(bytes));
    if (!withheld_[id]) best = std::min(best, bytes);
    if (lanes_[id].config.offered == Offered::kAlways) always = std::min(always, bytes);
  }
  lines.push_back(std::move(told));
  for (std::uint32_t id = 0; id < lanes_.size() && encodes(id); ++id) {
    const double bytes = trials_->bytes_per_frame(id);
    const Offered offered = lanes_[id].config.offered;
    if (offered == Offered::kAlways || played(id) != nullptr || bytes <= 0 || std::isinf(always)) continue;
    // A dearer one may be better still, but not for every client.
    const double other = offered == Offered::kOnceItPays ? best : always;
    const bool changes = withheld_[id] ? bytes < kWorthwhile * other : always < kWorthwhile * bytes;
    if (!changes) continue;
    withheld_[id] = !withheld_[id];
    streams_are_new_ = true;
    lines.push_back(
        fmt::format("stream {} is {} from now on", called(id), withheld_[id] ? "not offered" : "offered"));
  }
}

void LiveSource::settle_inputs() {
  const auto acted = [this](const Waiting& w) { return w.drive.frame <= frame() + 1; };
  for (const Waiting& waiting : scheduled_)
    if (acted(waiting)) drive_ = waiting.drive.drive;
  std::erase_if(scheduled_, acted);
}

}  // namespace tandem::host
