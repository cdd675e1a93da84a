#include "services/recording/playback.hpp"

#include <algorithm>
#include <utility>

#include "sdk/transport/cdr.hpp"
#include "sdk/transport/limits.hpp"

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
      deltas({.delta_bytes = session.streams[stream].max_delta_bytes}),
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
  return McapReader::open(std::move(file)).map([](McapReader&& reader) {
    return std::unique_ptr<Playback>(new Playback(std::move(reader)));
  });
}

double Playback::seconds_since_first(std::uint64_t ns) const {
  return static_cast<double>(ns - std::min(ns, reader_.first_ns())) / 1e9;
}

void Playback::rewind() {
  run_.reset();
  time_ns_ = 0;
  reader_.rewind();
}

// Sessions stand in front of every snapshot that a recorder cuts.
std::vector<McapReader::Place> Playback::starts() const {
  auto starts = reader_.chunks_with(transport::SnapshotMessage::kTopic);
  const auto sessions = reader_.chunks_with(transport::SessionMessage::kTopic);
  std::erase_if(starts, [&](const McapReader::Place& start) {
    return std::ranges::none_of(sessions, [&](const auto& session) { return session.at == start.at; });
  });
  return starts;
}

void Playback::seek(double from_s) {
  rewind();
  for (const McapReader::Place& start : starts()) {
    if (seconds_since_first(start.first_ns) <= from_s) reader_.go_to(start);
  }
}

// Epochs and frames only grow within a file, so that a few snapshots have to be looked at.
Result<void> Playback::seek(Epoch epoch, Frame frame) {
  const std::vector<McapReader::Place> all = starts();
  std::size_t from = 0, to = all.size();  // the last start not behind is below `to`
  while (from < to) {
    const std::size_t middle = from + (to - from) / 2;
    rewind();
    reader_.go_to(all[middle]);
    const auto step = next();
    if (!step) return tl::unexpected(step.error());
    // A start without a frame behind it was cut short: there is nothing from there on.
    const bool behind = *step == Step::kEnd || session().epoch > epoch ||
                        (session().epoch == epoch && timeline().applied() > frame);
    (behind ? to : from) = behind ? middle : middle + 1;
  }
  rewind();
  if (from > 0) reader_.go_to(all[from - 1]);
  return {};
}

Result<Playback::Step> Playback::next() {
  inputs_.clear();
  for (;;) {
    if (run_) {
      auto applied = apply_next();
      if (!applied) return tl::unexpected(applied.error());
      if (*applied) return **applied;
    }
    McapMessage message;
    const auto more = reader_.next(message);
    if (!more) return tl::unexpected(more.error());
    if (!*more) return Step::kEnd;
    time_ns_ = message.log_time_ns;
    auto taken = take(message);
    if (!taken) return tl::unexpected(taken.error());
    if (*taken) return **taken;
  }
}

Result<std::optional<Playback::Step>> Playback::take(const McapMessage& message) {
  constexpr std::optional<Step> kNothing;
  if (message.topic == transport::SessionMessage::kTopic) {
    if (auto known = check_version(message); !known) return tl::unexpected(known.error());
    auto session = read<transport::SessionMessage>(message);
    if (!session) return tl::unexpected(session.error());
    return take(std::move(*session)).map([&] { return kNothing; });
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
    if (!run_->holds(*delta)) return kNothing;
    const Frame frame = delta->frame;
    if (run_->deltas.add(std::move(*delta)) == client::DeltaAssembly::Outcome::kRefused)
      return fail(ErrorCode::kMalformed, "frame " + std::to_string(frame) + ": a delta that breaks a rule");
  }
  return kNothing;
}

// A session that is announced again, in front of a snapshot or with other names, goes on.
Result<void> Playback::take(transport::SessionMessage message) {
  transport::complete_layouts(message);
  if (run_ && message.epoch == run_->session.epoch && message.streams == run_->session.streams) {
    run_->session.names = std::move(message.names);
    return {};
  }
  auto playable = client::choose_stream(message);
  if (!playable) return tl::unexpected(playable.error());
  run_ = std::make_unique<Run>(std::move(message), std::move(*playable));
  return {};
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
  const auto whole = run.snapshots.take();
  // A snapshot that the recorder cut contains only a state that is held already.
  if (!whole || (run.timeline.playing() && whole->frame <= run.timeline.applied())) return std::nullopt;
  const auto loaded = run.timeline.load(whole->bytes, run.session.epoch, stream().id);
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
  return Step::kFrame;
}

}  // namespace tandem::recording
