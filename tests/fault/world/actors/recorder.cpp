#include "tests/fault/world/actors/recorder.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <deque>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "services/follow/recording/playback.hpp"

namespace tandem::world {
namespace {

namespace fs = std::filesystem;

/// While it lives, no file of this process can grow: the disk is full.
class FullDisk {
 public:
  explicit FullDisk(bool full, const std::string& path) : full_(full) {
    if (!full_) return;
    std::error_code ignored;
    const auto size = fs::file_size(path, ignored);
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit now = before_;
    now.rlim_cur = ignored ? 0 : static_cast<rlim_t>(size);
    std::signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &now);
  }
  ~FullDisk() {
    if (full_) setrlimit(RLIMIT_FSIZE, &before_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  bool full_;
  rlimit before_{};
};

constexpr recording::Clocks kClocks{&Clock::shown, &Clock::shown_wall};

fs::path folder() {
  const fs::path memory = "/dev/shm";
  return fs::is_directory(memory) ? memory : fs::temp_directory_path();
}

}  // namespace

/// The truth beside the recording, and how many frames that has.
class RecorderActor::Counting final : public WitnessSink {
 public:
  Counting(Stage& stage, const std::string& who, recording::Recorder& recorder)
      : WitnessSink(stage, who), stage_(stage), recorder_(recorder) {}
  void on_applied(const client::CompleteDelta& delta, std::int64_t now_ns) override {
    WitnessSink::on_applied(delta, now_ns);
    if (!recorder_.good()) return;
    ++frames;
    added_ns_.push_back(stage_.now_ns);
    while (stage_.now_ns - added_ns_.front() > kOpenNs) added_ns_.pop_front();
  }
  /// Frames that have left the open chunk, whatever it holds.
  [[nodiscard]] std::uint64_t settled() const { return frames - added_ns_.size(); }

  std::uint64_t frames = 0;  ///< that were recorded without an error

 private:
  static constexpr std::int64_t kOpenNs = 4'100 * kMs;
  Stage& stage_;
  std::deque<std::int64_t> added_ns_;  // the last frames
  recording::Recorder& recorder_;
};

RecorderActor::RecorderActor(Stage& stage, std::string name, const Service& server, std::uint64_t first_id)
    : Actor(stage, std::move(name)),
      server_(server),
      next_id_(first_id),
      path_((folder() / ("tandem-world-" + std::to_string(getpid()) + ".mcap")).string()) {}

RecorderActor::~RecorderActor() {
  drop();
  std::error_code ignored;
  fs::remove(path_, ignored);
  fs::remove(path_ + ".part", ignored);
}

std::vector<transport::ParticipantId> RecorderActor::participants() const {
  if (!port_) return {};
  return {port_->self()};
}

void RecorderActor::on_start() {
  const bool packs = stage_.settings.seed % 2 == 0;
  auto made = recording::Recorder::create(
      path_, packs ? recording::Compression::kZstd : recording::Compression::kNone);
  if (!made) throw std::runtime_error(made.error().message);
  recorder_ = std::make_unique<recording::Recorder>(std::move(*made));
  port_ = std::move(*stage_.network.make_client("default"));
  recording_port_ = std::make_unique<tool::RecordingPort>(*port_, *recorder_, kClocks);
  client::CoreOptions options;
  options.session = "default";
  options.id = next_id_++;
  options.role = transport::Role::kObserver;
  options.prefer = "bandwidth";
  client_ = std::make_unique<following::SessionClient>(std::move(options), *recording_port_);
  recording_ = std::make_unique<recording::RecordingSink>(*recorder_, *client_, kClocks);
  counting_ = std::make_unique<Counting>(stage_, name(), *recorder_);
  counting_->watch(*client_);
  due_ns_ = 0;
}

void RecorderActor::drop() {
  counting_.reset();
  recording_.reset();
  client_.reset();
  recording_port_.reset();
  recorder_.reset();
  port_.reset();
}

void RecorderActor::on_poll() {
  const FullDisk disk(full_, path_);
  const client::Now now{steady_ns(), wall_ns()};
  const std::array<following::SessionSink*, 2> sinks{recording_.get(), counting_.get()};
  due_ns_ = std::min(client_->poll(sinks, now), steady_ns() + 50 * kMs);
  if (recorder_->good()) return;
  finish();  // as the program does, which is then started again
  ended(stage_.now_ns + kSecond);
}

void RecorderActor::finish() {
  const bool good = recorder_->good();
  const std::uint64_t frames = counting_->frames;
  const auto finished = recorder_->finish();
  if (!finished) tell(finished.error().message);
  if (!good && finished) blame("recording", "a file that could not be written counts as complete");
  // What could not be written is the chunk that was open.
  const std::uint64_t least = finished ? frames : counting_->settled();
  if (recorder_->totals().frames < least || (finished && frames > 0 && recorder_->totals().frames != frames))
    blame("recording", "says that it holds " + std::to_string(recorder_->totals().frames) + " of " +
                           std::to_string(frames) + " frames");
  drop();
  play_back(least);
}

void RecorderActor::on_leave() {
  const FullDisk disk(full_, path_);
  finish();
}

void RecorderActor::on_crash(bool /*power_fails*/) {
  // A chunk may be open; nothing else may be missing.
  const std::uint64_t settled = counting_->settled();
  drop();
  play_back(settled);
}

void RecorderActor::play_back(std::uint64_t least) {
  if (!fs::exists(path_)) {
    if (least > 0) blame("recording", "there is no file with " + std::to_string(least) + " frames");
    return;
  }
  const auto playback = recording::Playback::open(path_);
  if (!playback) return blame("recording", playback.error().message);
  std::uint64_t frames = 0;
  while (true) {
    const auto step = (*playback)->next();
    if (!step) return blame("recording", step.error().message);
    if (*step == recording::Playback::Step::kEnd) break;
    const Epoch epoch = (*playback)->session().epoch;
    const ClientTimeline& timeline = (*playback)->timeline();
    if (const std::string wrong =
            stage_.truth.hold(epoch, (*playback)->stream().id.id, timeline.applied(), timeline.hash());
        !wrong.empty())
      return blame("recording", wrong);
    if (*step == recording::Playback::Step::kFrame) ++frames;
  }
  tell("recorded " + std::to_string(frames) + " frames");
  if (frames < least)
    blame("recording",
          "plays " + std::to_string(frames) + " frames, of " + std::to_string(least) + " at least");
  fs::remove(path_);
}

void RecorderActor::check() {
  if (!client_ || std::min(well_for_ns(), server_.serves_for_ns()) < Rules::kPlaysNs) return;
  if (client_->core().phase() == ClientPhase::kRefused && stage_.network.counts().damaged > 0) return;
  if (client_->core().phase() != ClientPhase::kPlaying)
    blame("getting in", "does not play: " + client_->core().status().reason);
}

void RecorderActor::check_end() {
  if (up() && !paused()) leave(INT64_MAX);
}

}  // namespace tandem::world
