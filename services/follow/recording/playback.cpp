#include "services/follow/recording/playback.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/cdr.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::recording {
namespace {

template <class M>
Result<M> read(const McapMessage& message) {
  const auto refuse = [](ErrorCode code, const std::string& what) {
    return fail(code, std::string(M::kTopic) + ": " + what);
  };
  if (message.encoding != "cdr")
    return refuse(ErrorCode::kUnsupported, "encoded as '" + std::string(message.encoding) + "', not as cdr");
  auto read = transport::read_cdr<M>(message.content, transport::Padding::kAny);
  if (!read) return refuse(read.error().code, read.error().message);
  if (!transport::within_limits(*read, transport::Limits{}))
    return refuse(ErrorCode::kMalformed, "lengths or counts out of range");
  return read;
}

/// Of messages with the same log time: what another needs comes first.
std::uint32_t rank(std::string_view topic) {
  constexpr std::array<std::string_view, 4> kFirst{
      transport::SessionMessage::kTopic, transport::ScheduledInputMessage::kTopic,
      transport::SnapshotMessage::kTopic, transport::DeltaMessage::kTopic};
  return static_cast<std::uint32_t>(std::ranges::find(kFirst, topic) - kFirst.begin());
}

/// That are remembered, so that two sessions at the same time are told from one behind the other.
constexpr std::size_t kMaxEpochs = 4096;

// In another version the rest of an announcement may have another layout.
Result<void> check_version(const McapMessage& session) {
  const auto version = transport::session_version(session.content);
  if (!version || *version == transport::kProtocolVersion) return {};
  return fail(ErrorCode::kUnsupported, "recorded with protocol version " + std::to_string(*version) +
                                           ", and this program reads version " +
                                           std::to_string(transport::kProtocolVersion) +
                                           ". Play it with a tandem of that time");
}

}  // namespace

Playback::Run::Run(transport::SessionMessage announced, client::Playable playable)
    : session(std::move(announced)),
      stream(playable.stream),
      timeline(std::move(playable.timeline)),
      deltas({.earlier = transport::max_earlier(session.capacity),
              .period_ns = period_ns_of(session.frame_rate_hz),
              .delta_bytes = session.streams[stream].max_delta_bytes}),
      snapshots(session.streams[stream].max_snapshot_bytes) {}

Result<std::unique_ptr<Playback>> Playback::open(const std::string& path) {
  auto file = InputFile::open(path);
  if (!file) return tl::unexpected(file.error());
  auto opened = open(std::move(*file));
  if (!opened) return fail(opened.error().code, path + ": " + opened.error().message);
  return opened;
}

Result<std::unique_ptr<Playback>> Playback::open(std::span<const std::byte> file) {
  return open(InputFile(file));
}

Result<std::unique_ptr<Playback>> Playback::open(InputFile file) {
  return McapReader::open(std::move(file), rank).map([](McapReader&& reader) {
    return std::unique_ptr<Playback>(new Playback(std::move(reader)));
  });
}

std::string Playback::left_out() const {
  std::string out;
  if (const auto torn = torn_at()) out = "is cut short at byte " + std::to_string(*torn);
  const McapReader::Damage damage = reader_.damage();
  if (damage.chunks == 0) return out;
  if (!out.empty()) out += ", and ";
  return out + "is damaged (" + damage.first + (damage.chunks > 1 ? ", and elsewhere" : "") +
         "); what is there and cannot be read is left out";
}

double Playback::seconds_since_first(std::uint64_t ns) const {
  return static_cast<double>(ns - std::min(ns, reader_.first_ns())) / 1e9;
}

void Playback::rewind() {
  run_.reset();
  next_run_.reset();
  past_.clear();
  time_ns_ = read_ns_ = 0;
  reader_.rewind();
}

// A session stands in front of every snapshot, and with those that a recorder writes in the same chunk.
std::vector<Playback::Start> Playback::find_starts() const {
  std::vector<Start> starts;
  if (!reader_.in_order()) return starts;
  const auto sessions = reader_.chunks_with(transport::SessionMessage::kTopic);
  auto session = sessions.begin();
  for (const McapReader::Place& snapshot : reader_.chunks_with(transport::SnapshotMessage::kTopic)) {
    while (session != sessions.end() && session + 1 != sessions.end() && (session + 1)->at <= snapshot.at)
      ++session;
    if (session != sessions.end() && session->at <= snapshot.at)
      starts.push_back({.session = *session, .snapshot = snapshot});
  }
  return starts;
}

Result<void> Playback::read_starts() {
  if (std::exchange(read_starts_, true)) return {};
  for (Start& start : starts_) {
    const auto visited = reader_.visit(start.snapshot, [&start](const McapMessage& message) {
      if (message.topic != transport::SnapshotMessage::kTopic) return true;
      if (const auto snapshot = read<transport::SnapshotMessage>(message)) {
        start.epoch = snapshot->epoch;
        start.frame = snapshot->frame;
      }
      return false;
    });
    if (!visited) return visited;
  }
  return {};
}

void Playback::seek(double from_s) {
  rewind();
  for (const Start& start : starts_) {
    if (seconds_since_first(start.snapshot.first_ns) <= from_s) reader_.go_to(start.session);
  }
}

Result<bool> Playback::seek(Epoch epoch, Frame frame) {
  rewind();
  if (auto known = read_starts(); !known) return tl::unexpected(known.error());
  bool found = false;
  for (const Start& start : starts_) {
    if (start.epoch != epoch || (found && start.frame > frame)) continue;
    reader_.go_to(start.session);
    found = true;
  }
  return found || starts_.empty();
}

Result<Playback::Step> Playback::next() {
  inputs_.clear();
  time_ns_ = read_ns_;
  for (;;) {
    if (next_run_) begin(std::move(next_run_));
    if (run_) {
      auto applied = apply_next();
      if (!applied) return tl::unexpected(applied.error());
      if (*applied) return **applied;
    }
    McapMessage message;
    const auto more = reader_.next(message);
    if (!more) return tl::unexpected(more.error());
    if (!*more && !(run_ && run_->ahead)) return Step::kEnd;
    if (*more) time_ns_ = read_ns_ = message.log_time_ns;
    auto taken = *more ? take(message) : load_ahead();
    if (!taken) return tl::unexpected(taken.error());
    if (*taken) return **taken;
  }
}

void Playback::begin(std::unique_ptr<Run> run) {
  TANDEM_ASSERT(run != nullptr);
  if (run_ && run_->session.epoch != run->session.epoch && past_.size() < kMaxEpochs)
    past_.push_back(run_->session.epoch);
  run_ = std::move(run);
}

Result<std::optional<Playback::Step>> Playback::take(const McapMessage& message) {
  constexpr std::optional<Step> kNothing;
  if (message.topic == transport::SessionMessage::kTopic) {
    if (auto known = check_version(message); !known) return tl::unexpected(known.error());
    auto session = read<transport::SessionMessage>(message);
    if (!session) return tl::unexpected(session.error());
    return take(std::move(*session));
  }
  if (!run_) return kNothing;
  if (message.topic == transport::ScheduledInputMessage::kTopic) {
    const auto input = read<transport::ScheduledInputMessage>(message);
    if (!input) return tl::unexpected(input.error());
    return take(*input).map([&] { return kNothing; });
  }
  if (message.topic == transport::SnapshotMessage::kTopic) {
    auto snapshot = read<transport::SnapshotMessage>(message);
    if (!snapshot) return tl::unexpected(snapshot.error());
    return take(std::move(*snapshot));
  }
  if (message.topic == transport::DeltaMessage::kTopic) {
    auto delta = read<transport::DeltaMessage>(message);
    if (!delta) return tl::unexpected(delta.error());
    return take(std::move(*delta));
  }
  return kNothing;
}

// A session that is announced again, in front of a snapshot or with other names, goes on.
Result<std::optional<Playback::Step>> Playback::take(transport::SessionMessage message) {
  transport::complete_layouts(message);
  if (run_ && message.epoch == run_->session.epoch && message.streams == run_->session.streams) {
    run_->session.names = std::move(message.names);
    return std::nullopt;
  }
  auto playable = client::choose_stream(message);
  if (!playable) return tl::unexpected(playable.error());
  next_run_ = std::make_unique<Run>(std::move(message), std::move(*playable));
  return load_ahead();
}

Result<std::optional<Playback::Step>> Playback::take(transport::DeltaMessage message) {
  Run& run = *run_;
  if (message.epoch != run.session.epoch && std::ranges::find(past_, message.epoch) != past_.end())
    return fail(ErrorCode::kUnsupported, "two sessions at the same time: epoch " +
                                             std::to_string(message.epoch) + " goes on behind epoch " +
                                             std::to_string(run.session.epoch) +
                                             "; only files of one session each can be played");
  if (!run.holds(message)) return std::nullopt;
  const Frame frame = message.frame;
  if (run.deltas.add(std::move(message)) == client::DeltaAssembly::Outcome::kRefused)
    return fail(ErrorCode::kMalformed, "frame " + std::to_string(frame) + ": a delta that breaks a rule");
  // What would fill the gap in front of the snapshot does not come any more.
  if (run.ahead && frame > run.ahead->frame) return load_ahead();
  return std::nullopt;
}

Result<void> Playback::take(const transport::ScheduledInputMessage& message) {
  Run& run = *run_;
  if (message.epoch != run.session.epoch) return {};
  const auto drive = client::read_scheduled(message);
  if (!drive) return tl::unexpected(drive.error());
  run.drives.add(*drive);
  run.inputs.emplace(message.number, message);
  if (run.inputs.size() > client::ScheduledInputs::kKept) run.inputs.erase(run.inputs.begin());
  return {};
}

Result<std::optional<Playback::Step>> Playback::take(transport::SnapshotMessage message) {
  Run& run = *run_;
  if (!run.holds(message)) return std::nullopt;
  if (run.snapshots.add(std::move(message)) == client::SnapshotAssembly::Outcome::kRefused)
    return fail(ErrorCode::kMalformed, "a snapshot that breaks a rule of the format");
  auto whole = run.snapshots.take();
  if (!whole) return std::nullopt;
  if (!run.timeline.playing()) return load(*whole);
  // One that the recorder cut contains only a state that is held already, or will be in a moment: by their
  // log times, it may stand in front of frames that it contains.
  if (whole->frame > run.timeline.applied()) {
    run.ahead = std::move(*whole);
    run.ahead_ns = time_ns_;
  }
  return std::nullopt;
}

Result<std::optional<Playback::Step>> Playback::load_ahead() {
  if (!run_ || !run_->ahead) return std::nullopt;
  time_ns_ = run_->ahead_ns;
  const auto snapshot = std::exchange(run_->ahead, std::nullopt);
  if (snapshot->frame <= run_->timeline.applied()) return std::nullopt;
  return load(*snapshot);
}

Result<std::optional<Playback::Step>> Playback::load(const transport::SnapshotMessage& snapshot) {
  Run& run = *run_;
  const auto loaded = run.timeline.load(snapshot.bytes, run.session.epoch, stream().id);
  if (!loaded) return tl::unexpected(loaded.error());
  run.deltas.drop_through(run.timeline.applied());
  return Step::kStarted;
}

Result<std::optional<Playback::Step>> Playback::apply_next() {
  Run& run = *run_;
  ClientTimeline& timeline = run.timeline;
  if (!timeline.playing()) return std::nullopt;
  run.deltas.drop_through(timeline.applied());
  const client::CompleteDelta* const delta = run.deltas.front();
  // Behind a gap nothing fits until the next snapshot.
  if (delta == nullptr || delta->frame != timeline.applied() + 1) return std::nullopt;
  auto applied = run.drives.hand_over(timeline, delta->last_input);
  if (applied) applied = timeline.apply(delta->frame, delta->last_input, delta->hash, delta->payload);
  if (!applied)
    return fail(applied.error().code,
                "frame " + std::to_string(delta->frame) + ": " + applied.error().message);
  while (!run.inputs.empty() && run.inputs.begin()->first <= delta->last_input) {
    inputs_.push_back(std::move(run.inputs.begin()->second));
    run.inputs.erase(run.inputs.begin());
  }
  delta_ = *delta;
  run.deltas.pop();
  if (run.ahead && run.ahead->frame <= timeline.applied()) run.ahead.reset();
  return Step::kFrame;
}

}  // namespace tandem::recording
