#pragma once
// Makes the files of an audience out of what a client takes in: segments, snapshots, chapters and the
// manifest (idl/AUDIENCE.md).

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sdk/client/following/delta_assembly.hpp"
#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"
#include "services/follow/audience/manifest.hpp"
#include "services/follow/audience/shelf.hpp"

namespace tandem::audience {

/// Takes one stream of a session at a time, frame by frame, and puts files on a shelf: objects that never
/// change and, behind them, the manifest that names them. What no manifest names any more is removed after
/// kGraceNs, because readers may hold an older manifest. Has no clock, thread or file. After an error nothing
/// more is put. Not thread-safe.
class Writer {
 public:
  static constexpr std::int64_t kSegmentNs = kSecond;       ///< of a segment, by the server's clock
  static constexpr std::int64_t kPassageNs = 10 * kSecond;  ///< from one snapshot to the next
  static constexpr std::int64_t kChapterNs = 60 * kSecond;  ///< of the passages that one object lists
  static constexpr std::int64_t kGraceNs = 60 * kSecond;    ///< from the last manifest to the removal
  /// A longer time between two frames counts as this: nobody wants to watch a server that is suspended.
  static constexpr std::int64_t kLongestFrameNs = kSecond;
  static constexpr std::size_t kMaxSegmentBytes = 32U
                                                  << 20U;  ///< a segment ends with the delta that reaches it

  struct Options {
    std::int64_t keep_ns = 0;      ///< of the time line, at least; 0: all
    std::uint64_t keep_bytes = 0;  ///< of all objects, at most, but for the newest passage; 0: all
    std::uint64_t began_ms = 0;    ///< wall clock; a later writer of the same folder has a higher one
  };

  /// `shelf` must outlive it.
  Writer(Shelf& shelf, const Options& options) : shelf_(&shelf), options_(options) {
    manifest_.writer = options.began_ms;
  }

  /// Goes on behind what an earlier writer left on the shelf, before anything is added. `chapters`: the
  /// passages of each of its chapters, which is only needed if old ones are to be removed; else empty.
  void go_on(Manifest before, std::vector<std::vector<Passage>> chapters);

  /// Announces the session with the stream that follows, and nothing but it. Another epoch, stream or
  /// generation begins a run, with the next snapshot; other names are told where the run goes on.
  void add(const transport::SessionMessage& session);
  /// The agreed state of `frame`, as a snapshot: of the last delta's frame, or of another, with which another
  /// run begins.
  void add_snapshot(Frame frame, std::span<const std::byte> snapshot);
  /// A scheduled input, before the first delta that counts it.
  void add(const transport::ScheduledInputMessage& input);
  /// The next delta. One that does not follow the last is passed over, until a snapshot comes.
  void add(Epoch epoch, const client::CompleteDelta& delta, std::int64_t steady_ns);

  /// It is time for add_snapshot() of the last delta's frame.
  [[nodiscard]] bool wants_snapshot() const;
  /// Call after what came together was added: puts the manifest if it has changed, ends a segment to which
  /// nothing is added, and removes what is due.
  void turned(std::int64_t steady_ns);
  /// Puts what is left, and a manifest that says that there is no more. Errors: the first of the shelf.
  [[nodiscard]] Result<void> finish(std::int64_t steady_ns);

  /// False after an error of the shelf.
  [[nodiscard]] bool good() const { return written_.has_value(); }
  [[nodiscard]] const Result<void>& written() const { return written_; }

  struct Totals {
    std::uint64_t frames = 0, payload_bytes = 0;
    std::uint64_t segments = 0, segment_bytes = 0;
    std::uint64_t snapshots = 0, snapshot_bytes = 0;
    std::uint64_t manifests = 0, manifest_bytes = 0;
    std::uint64_t objects = 0, object_bytes = 0;  ///< that are there now
  };
  [[nodiscard]] const Totals& totals() const { return totals_; }
  [[nodiscard]] const Manifest& manifest() const { return manifest_; }
  /// Calls `call` with the path of each object that the manifest or a chapter names.
  template <class Call>
  void each_object(const Call& call) const {
    for (const auto& [path, use] : used_) call(path);
  }

 private:
  struct Use {
    std::uint64_t size_bytes = 0;
    std::uint32_t times = 0;
  };
  struct Removal {
    std::int64_t due_ns = 0;
    std::string path;
  };

  Object put(std::span<const std::byte> bytes, ObjectKind kind);
  void put_manifest();
  void use(const Object& object);
  void use(const std::vector<Passage>& passages);
  void drop(const Object& object, std::int64_t steady_ns);
  void drop(const std::vector<Passage>& passages, std::int64_t steady_ns);
  void announce();
  void end_segment();
  void fold();
  void forget_old(std::int64_t steady_ns);
  [[nodiscard]] std::uint64_t newest_ms() const { return static_cast<std::uint64_t>(at_ns_ / kMillisecond); }

  Shelf* shelf_;
  Options options_;
  Result<void> written_;
  Manifest manifest_;
  bool changed_ = false;  ///< since the last manifest
  Totals totals_;

  std::optional<transport::SessionMessage> session_;
  bool in_run_ = false;  ///< the last run of the manifest is that of session_, and a snapshot of it came
  std::map<std::uint64_t, transport::ScheduledInputMessage> inputs_;  ///< that no delta has counted
  Frame frame_ = 0;                                                   ///< of the last delta or snapshot
  std::int64_t server_time_ns_ = 0;               ///< of the last delta; 0: none in the run
  std::int64_t at_ns_ = 0;                        ///< of the time line
  std::int64_t passage_ns_ = 0, segment_ns_ = 0;  ///< where the open ones began

  transport::Bytes segment_;  ///< open
  std::uint32_t segment_frames_ = 0;
  std::int64_t segment_began_ns_ = 0;  ///< steady

  std::map<std::string, Use> used_;          ///< by path: how often the manifest and its chapters name it
  std::deque<std::vector<Passage>> folded_;  ///< what the chapters hold, where any may be removed
  std::deque<Removal> removals_;             ///< by time
};

}  // namespace tandem::audience
