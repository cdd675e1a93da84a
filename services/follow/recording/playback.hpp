#pragma once
// Follows a recording frame by frame, and holds the states that a client of the recorded session would hold.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/client/following/delta_assembly.hpp"
#include "sdk/client/following/scheduled_inputs.hpp"
#include "sdk/client/following/snapshot_assembly.hpp"
#include "sdk/client/session/session_check.hpp"
#include "services/follow/recording/events.hpp"
#include "services/follow/recording/input_file.hpp"
#include "services/follow/recording/mcap_reader.hpp"

namespace tandem::recording {

/// Follows the messages of a file as a client does, and checks every hash. A *run* is a snapshot and the
/// frames that follow it without a gap; a file has several where the recorder had to join again, or where the
/// server was restarted. The contents of a file are untrusted. Not thread-safe.
class Playback {
 public:
  /// Errors, naming the file: kIo, kMalformed, kUnsupported.
  static Result<std::unique_ptr<Playback>> open(const std::string& path);
  /// Opens bytes, which must outlive the playback. Errors name no file.
  static Result<std::unique_ptr<Playback>> open(std::span<const std::byte> file);

  enum class Step : std::uint8_t {
    kStarted,  ///< a run begins: the state of its snapshot is held
    kFrame,    ///< one more frame is applied
    kEnd,      ///< the file ends, or is cut short, here
  };
  /// Errors: kMalformed, kUnsupported, kMismatch (a frame's hash), kIo (also: the file became shorter). After
  /// an error nothing more can be read.
  [[nodiscard]] Result<Step> next();
  /// Goes to the last snapshot with which next() begins a run no later than `from_s`, if the file has one;
  /// from there on call next() until time_s() is late enough.
  void seek(double from_s);
  /// Goes to the last snapshot of an epoch that is not later than `frame`, or to the epoch's first; from
  /// there on call next() until the frame is there. Epochs have the order of the file: their numbers come
  /// from wall clocks. Without such an epoch it goes to the file's begin, and returns false if it knows that.
  /// Errors: as next().
  [[nodiscard]] Result<bool> seek(Epoch epoch, Frame frame);

  /// When the current message was recorded, wall clock, ns since 1970.
  [[nodiscard]] std::uint64_t time_ns() const { return time_ns_; }
  /// The time of the first message; 0 if there is none.
  [[nodiscard]] std::uint64_t first_ns() const { return reader_.first_ns(); }
  /// The times of the current and of the last message, in seconds since the first.
  [[nodiscard]] double time_s() const { return seconds_since_first(time_ns_); }
  [[nodiscard]] double length_s() const { return seconds_since_first(reader_.last_ns()); }
  /// What the file says that happened: see read_events().
  [[nodiscard]] const std::vector<RecordedEvent>& events() const { return events_; }
  /// The time of an event, in seconds since the first message.
  [[nodiscard]] double time_s(const RecordedEvent& event) const { return seconds_since_first(event.time_ns); }
  /// The place where the file is cut short, if it is.
  [[nodiscard]] std::optional<std::uint64_t> torn_at() const { return reader_.torn_at(); }
  /// What of the file could not be read so far and was left out, as the rest of a line behind the file's
  /// name; empty if nothing was.
  [[nodiscard]] std::string left_out() const;
  /// Why nothing can be played of a file that has no run; likewise.
  static constexpr const char* kNothingToPlay =
      "has no snapshot to begin from; what plays begins with a TandemSession and a TandemSnapshot";

  /// There has been a kStarted.
  [[nodiscard]] bool has_run() const { return run_ && run_->timeline.playing(); }
  // The current run, after the first kStarted:
  [[nodiscard]] const transport::SessionMessage& session() const { return run_->session; }
  [[nodiscard]] const transport::StreamMessage& stream() const { return run_->session.streams[run_->stream]; }
  [[nodiscard]] ClientTimeline& timeline() { return run_->timeline; }
  // The last kFrame:
  [[nodiscard]] const client::CompleteDelta& delta() const { return delta_; }
  /// The scheduled inputs that its delta is the first to promise, by number.
  [[nodiscard]] const std::vector<transport::ScheduledInputMessage>& inputs() const { return inputs_; }

 private:
  // The data of one epoch.
  struct Run {
    Run(transport::SessionMessage announced, client::Playable playable);
    template <class M>
    [[nodiscard]] bool holds(const M& message) const {
      return message.epoch == session.epoch && message.stream == session.streams[stream].id;
    }
    transport::SessionMessage session;
    std::size_t stream;
    ClientTimeline timeline;
    client::DeltaAssembly deltas;
    client::SnapshotAssembly snapshots;
    client::ScheduledInputs drives;
    std::map<std::uint64_t, transport::ScheduledInputMessage> inputs;  // beyond those of the last frame
    /// A snapshot ahead of the last frame. Where it fills no gap, the frames up to it still come.
    std::optional<transport::SnapshotMessage> ahead;
    std::uint64_t ahead_ns = 0;
  };

  explicit Playback(McapReader reader)
      : reader_(std::move(reader)), events_(read_events(reader_)), starts_(find_starts()) {}
  static Result<std::unique_ptr<Playback>> open(InputFile file);
  [[nodiscard]] double seconds_since_first(std::uint64_t ns) const;
  void rewind();
  // A place where next() can begin a run, with the snapshot that it reads first.
  struct Start {
    McapReader::Place session, snapshot;
    Epoch epoch = 0;  // of the snapshot, after read_starts()
    Frame frame = 0;
  };
  [[nodiscard]] std::vector<Start> find_starts() const;
  [[nodiscard]] Result<void> read_starts();
  // Each returns what the message brought about, if anything.
  [[nodiscard]] Result<std::optional<Step>> take(const McapMessage& message);
  [[nodiscard]] Result<std::optional<Step>> take(transport::SessionMessage message);
  [[nodiscard]] Result<void> take(const transport::ScheduledInputMessage& message);
  [[nodiscard]] Result<std::optional<Step>> take(transport::SnapshotMessage message);
  [[nodiscard]] Result<std::optional<Step>> take(transport::DeltaMessage message);
  [[nodiscard]] Result<std::optional<Step>> load(const transport::SnapshotMessage& snapshot);
  [[nodiscard]] Result<std::optional<Step>> load_ahead();
  void begin(std::unique_ptr<Run> run);
  [[nodiscard]] Result<std::optional<Step>> apply_next();

  McapReader reader_;
  std::vector<RecordedEvent> events_;
  std::vector<Start> starts_;
  bool read_starts_ = false;
  std::uint64_t time_ns_ = 0, read_ns_ = 0;  // of the step, and of the last message
  std::unique_ptr<Run> run_, next_run_;
  std::vector<Epoch> past_;  // epochs before that of run_
  client::CompleteDelta delta_;
  std::vector<transport::ScheduledInputMessage> inputs_;
};

}  // namespace tandem::recording
