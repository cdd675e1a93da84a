#pragma once
// What a server does with its checkpoints: go on from the newest, keep new ones, and have them at hand for
// servers that stand by.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/host/checkpoint/disk.hpp"
#include "services/host/checkpoint/folder.hpp"
#include "services/host/checkpoint/writer.hpp"

namespace tandem::checkpoint {

/// A server's choice.
struct Settings {
  std::string folder;     ///< empty: none on a disk
  double interval_s = 1;  ///< between two checkpoints, kLeastIntervalS .. kMaxIntervalS
  bool required = false;  ///< a server does not start without a checkpoint to go on from
};
inline constexpr double kLeastIntervalS = 0.01, kMaxIntervalS = 86400;

/// What a checkpoint must be of.
struct CheckpointWorld {
  std::string session, scene, engine;
  double dt_s = 0;
  std::vector<std::string> types;
};
/// Errors: kInvalidArgument, which says what the checkpoint is of and what was expected.
[[nodiscard]] Result<void> check_world(const Checkpoint& checkpoint, const CheckpointWorld& world,
                                       std::uint32_t capacity);
/// Has `simulation` go on from a checkpoint of that world. Errors: as check_world(); kInvalidArgument, if the
/// simulation refuses its part or an input that waits in it. It is as it was then.
[[nodiscard]] Result<void> load_world(const Checkpoint& checkpoint, const CheckpointWorld& world,
                                      engine::Simulation& simulation);

/// How a server starts.
struct Start {
  std::shared_ptr<const Checkpoint> goes_on_from;  ///< null: afresh. The simulation holds its state
  std::vector<std::string> warnings;               ///< one line each
  std::string told;        ///< one line: what it goes on from, or that it starts afresh
  Epoch newest_epoch = 0;  ///< the server's epoch has to be above this one
  /// The wanted epoch, or one above newest_epoch where a clock went back. Two starts from the same checkpoint
  /// have different ones, if they wanted different ones; begun_by() stays what it was.
  [[nodiscard]] Epoch epoch(Epoch wanted) const;
};

/// Not thread-safe; the writing is done by a thread of its own, unless a simulated machine does it.
class Keeper {
 public:
  /// Opens and locks the folder, if there is one. Errors: as open_folder(); kInvalidArgument for settings out
  /// of range.
  static Result<std::unique_ptr<Keeper>> open(const Settings& settings, std::int64_t (*clock_ns)());
  /// `disk`: null for none.
  Keeper(const Settings& settings, std::unique_ptr<Disk> disk, std::int64_t (*clock_ns)(),
         WritesIn writes_in = WritesIn::kOwnThread);

  /// Looks for the newest checkpoint of this world that `simulation` can load, and loads it. Without one, a
  /// simulation is left as it is. Errors: kUnsupported (required, and the simulation has no save()), kIo
  /// (required, and no checkpoint is good; the folder cannot be listed).
  [[nodiscard]] Result<Start> start(const CheckpointWorld& world, engine::Simulation& simulation);
  /// Instead of start(), for a server that takes over: `simulation` holds its state already, and holds it
  /// again afterwards; meanwhile it is asked which files are of its world. Returns the highest epoch in the
  /// folder. Errors: kIo.
  [[nodiscard]] Result<Epoch> take_over(const CheckpointWorld& world, engine::Simulation& simulation);

  /// Servers stand by, or none any more. Without a folder nothing is copied while there are none.
  void serve_standbys(bool any);
  /// Call after a frame: has `capture` copy the world if a checkpoint is due. `at_once`: also within the
  /// interval.
  void after_frame(std::int64_t now_ns, bool at_once, const std::function<void(Checkpoint&)>& capture);
  /// True if after_frame() would copy now.
  [[nodiscard]] bool takes_frame(std::int64_t now_ns, bool at_once);
  /// The newest checkpoint since servers stand by; null: none yet.
  [[nodiscard]] std::shared_ptr<const Encoded> latest() const;
  /// Changes Settings::interval_s, which is in its range, from the next checkpoint on.
  void set_interval(double interval_s);
  /// Writes a last checkpoint, so that an orderly end loses nothing. Waits at most two seconds.
  void end(std::int64_t now_ns, const std::function<void(Checkpoint&)>& capture);
  /// Writes the copy that was made last, if it is not written yet. Only for WritesIn::kWriteNow.
  void write_now();
  /// True if a copy is not written yet.
  [[nodiscard]] bool writing() const { return writer_ && !writer_->idle(); }
  [[nodiscard]] std::vector<std::string> take_notices(std::int64_t now_ns);
  /// Empty without a folder; all 0 for a simulation that cannot be saved.
  [[nodiscard]] std::optional<Figures> figures(std::int64_t now_ns) const;

 private:
  void make_writer(std::vector<std::byte> memory);

  Settings settings_;
  std::int64_t (*clock_ns_)();
  WritesIn writes_in_;
  std::unique_ptr<Disk> disk_;
  std::optional<Folder> folder_;
  bool can_save_ = false;
  std::optional<Writer> writer_;  // last member: it stops before its folder is destroyed
};

}  // namespace tandem::checkpoint
