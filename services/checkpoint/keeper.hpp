#pragma once
// What a server does with its checkpoints: go on from the newest, and keep new ones.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/checkpoint/disk.hpp"
#include "services/checkpoint/folder.hpp"
#include "services/checkpoint/writer.hpp"

namespace tandem::checkpoint {

/// A server's choice.
struct Settings {
  std::string folder;     ///< empty: no checkpoints
  double interval_s = 1;  ///< between two checkpoints, kLeastIntervalS .. kMostIntervalS
  bool required = false;  ///< a server does not start without a checkpoint to go on from
};
inline constexpr double kLeastIntervalS = 0.01, kMostIntervalS = 86400;

/// What a checkpoint must be of.
struct World {
  std::string session, scene, engine;
  double dt_s = 0;
  std::vector<std::string> types;
};
/// Errors: kInvalidArgument, which says what the checkpoint is of and what was expected.
[[nodiscard]] Result<void> check_world(const Checkpoint& checkpoint, const World& world,
                                       std::uint32_t capacity);

/// How a server starts.
struct Start {
  std::shared_ptr<const Checkpoint> goes_on_from;  ///< null: afresh. The simulation holds its state
  std::vector<std::string> warnings;               ///< one line each
  std::string told;        ///< one line: what it goes on from, or that it starts afresh
  Epoch newest_epoch = 0;  ///< the server's epoch has to be above this one
  /// The wanted epoch, or one above newest_epoch where a clock went back.
  [[nodiscard]] Epoch epoch(Epoch wanted) const;
};

/// Not thread-safe; the writing is done by a thread of its own.
class Keeper {
 public:
  /// Opens and locks the folder. Errors: as open_folder(); kInvalidArgument for settings out of range.
  static Result<std::unique_ptr<Keeper>> open(const Settings& settings, std::int64_t (*clock_ns)());
  Keeper(const Settings& settings, std::unique_ptr<Disk> disk, std::int64_t (*clock_ns)());

  /// Looks for the newest checkpoint of this world that `simulation` can load, and loads it. Without one, a
  /// simulation is left as it is. Errors: kUnsupported (required, and the simulation has no save()), kIo
  /// (required, and no checkpoint is good; the folder cannot be listed).
  [[nodiscard]] Result<Start> start(const World& world, engine::Simulation& simulation);

  /// Call after a frame: has `capture` copy the world if a checkpoint is due.
  void after_frame(std::int64_t now_ns, const std::function<void(Checkpoint&)>& capture);
  /// Changes Settings::interval_s, which is in its range, from the next checkpoint on.
  void set_interval(double interval_s);
  /// Writes a last checkpoint, so that an orderly end loses nothing. Waits at most two seconds.
  void end(std::int64_t now_ns, const std::function<void(Checkpoint&)>& capture);
  [[nodiscard]] std::vector<std::string> take_notices(std::int64_t now_ns);
  /// All 0 for a simulation that cannot be saved.
  [[nodiscard]] Figures figures(std::int64_t now_ns) const;

 private:
  Settings settings_;
  std::int64_t (*clock_ns_)();
  std::unique_ptr<Disk> disk_;
  Folder folder_;
  std::optional<Writer> writer_;  // last member: it stops before its folder is destroyed
};

}  // namespace tandem::checkpoint
