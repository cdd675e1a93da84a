#pragma once
// `tandem record` and `tandem join --capture`: writes the messages that a client received, applied and sent
// to an MCAP file (idl/PROTOCOL.md, "Recordings").

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "sdk/client/core_options.hpp"
#include "services/follow/recording/mcap_writer.hpp"
#include "services/follow/recording/output_file.hpp"

namespace tandem::recording {

/// Writes messages in the order in which the client took them in. The file is a new one, and has its name
/// from the first snapshot on. From then on it is readable up to the last chunk however the process ends.
/// The first time in the file is the wall clock's; from there on the steady clock counts, so that a wall
/// clock which is set moves nothing. No two times are the same, and they have the order of the messages. Not
/// thread-safe.
class Recorder {
 public:
  /// Time between the snapshots that a recorder cuts itself: the maximum that a replay computes to get
  /// anywhere.
  static constexpr std::int64_t kSnapshotNs = 60'000'000'000;

  /// Errors: as OutputFile::create().
  static Result<Recorder> create(const std::string& path, Compression compression,
                                 Existing existing = Existing::kStays);

  void add(const transport::SessionMessage& session, client::Now now);
  /// Adds the snapshot from which the client started or restarted.
  void add(const transport::SnapshotMessage& snapshot, client::Now now);
  void add(const transport::ScheduledInputMessage& input, client::Now now);
  /// Adds a delta of the previous snapshot's stream, as one part, however many parts it came in.
  void add(Epoch epoch, const client::CompleteDelta& delta, client::Now now);
  /// Adds messages that affect no state.
  void add(const transport::ReplyMessage& reply, client::Now now);
  void add(const transport::ServerStatusMessage& status, client::Now now);
  void add(const transport::AckMessage& ack, client::Now now);
  void add(const transport::InputMessage& input, client::Now now);
  void add(const transport::ClientStatusMessage& status, client::Now now);

  /// Adds a line about what happened, for people, as foxglove.Log of the topic /events. `who`: who says it.
  void add_event(std::string_view who, std::string_view what, client::Now now);

  /// kSnapshotNs have passed since the last snapshot in the file.
  [[nodiscard]] bool snapshot_due(std::int64_t steady_ns) const;
  /// Writes the agreed state of the last delta's frame, or of another that the session goes on from.
  void cut_snapshot(Frame frame, transport::Bytes snapshot, client::Now now);

  /// The file; it is not the wanted one if another of that name stays.
  [[nodiscard]] const OutputFile& file() const { return *file_; }
  /// Returns false after an error; nothing more is written then.
  [[nodiscard]] bool good() const { return named_ && writer_->written(); }
  /// Ends the file, or removes it if no snapshot came. Errors: kIo, also of anything written before.
  [[nodiscard]] Result<void> finish();

  /// What was added so far, and the bytes that the file got of it. Valid at any time.
  struct Progress {
    std::uint64_t frames = 0, snapshots_cut = 0, written_bytes = 0;
  };
  [[nodiscard]] Progress progress() const {
    return {.frames = counted_.frames,
            .snapshots_cut = counted_.snapshots_cut,
            .written_bytes = file_->written_bytes()};
  }

  /// For each topic: number of messages, and their bytes before compression.
  struct Share {
    std::uint64_t messages = 0, bytes = 0;
  };
  struct Totals {
    std::uint64_t frames = 0, payload_bytes = 0;
    std::uint64_t snapshots_cut = 0;
    std::uint64_t file_bytes = 0;   ///< of all; 0 where the file was dropped
    std::uint64_t start_bytes = 0;  ///< of these, the chunks of snapshots and their sessions
    std::uint64_t fixed_bytes = 0;  ///< of these, what a file without messages has
    std::map<std::string, Share> topics;
  };
  /// Counts the file's contents, so not a chunk that could not be written. Valid after finish().
  [[nodiscard]] const Totals& totals() const { return totals_; }

 private:
  Recorder(OutputFile file, Compression compression);
  template <class M>
  void write(const M& message, client::Now now, std::optional<std::int64_t> published_ns = {});
  template <class M>
  void add_plain(const M& message, client::Now now, std::optional<std::int64_t> published_ns = {});
  [[nodiscard]] std::int64_t stamp(client::Now now);
  void settle();
  void end_chunk();
  void start(const transport::SnapshotMessage& snapshot, client::Now now);

  std::unique_ptr<OutputFile> file_;  // stays where it is: the writer's sink
  Result<void> named_;
  std::unique_ptr<McapWriter> writer_;  // stays where it is
  std::optional<transport::SessionMessage> session_;
  StreamId stream_;
  /// Inputs that no delta in the file has counted yet; a reader that starts from a snapshot needs them after
  /// it.
  std::map<std::uint64_t, transport::ScheduledInputMessage> unpromised_;
  std::optional<std::int64_t> offset_ns_;   // from the steady clock to the times in the file
  std::int64_t stamp_ns_ = 0;               // the last of these
  std::optional<std::int64_t> started_ns_;  // the last snapshot, steady
  Totals counted_;                          // with the open chunk
  Totals totals_;                           // up to the last chunk that is in the file
  std::uint64_t settled_bytes_ = 0;         // of the file then
};

}  // namespace tandem::recording
