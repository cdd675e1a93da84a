#pragma once
// The checkpoints of a session that has a host: on a disk, and for servers that stand by.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "services/host/checkpoint/keeper.hpp"
#include "services/host/host.hpp"

namespace tandem::host {

/// Begins a session from its newest checkpoint, and keeps new ones. Not thread-safe.
class Keeping {
 public:
  /// Takes lines for a log; warnings need somebody's attention.
  using Log = std::function<void(const std::string& line, bool warning)>;

  /// Finds the checkpoint to go on from, and has simulation and `config` begin there. Errors: as
  /// Keeper::open() and Keeper::start().
  static Result<Keeping> begin(const checkpoint::Settings& settings, engine::Simulation& simulation,
                               HostConfig& config, Log log, std::int64_t (*clock_ns)());
  /// For a server that stands by: locks the folder. Call take_over() before there is a host.
  static Result<Keeping> stand_by(const checkpoint::Settings& settings, Log log, std::int64_t (*clock_ns)());
  /// With a keeper that was started by the caller.
  Keeping(std::unique_ptr<checkpoint::Keeper> keeper, Log log, std::int64_t (*clock_ns)());
  /// The session continues `world` of the server `from`, and `simulation` holds its state. `epoch`: the
  /// wanted one. Errors: kIo.
  [[nodiscard]] Result<void> take_over(std::shared_ptr<const checkpoint::Checkpoint> world,
                                       const transport::ParticipantId& from, Epoch epoch,
                                       engine::Simulation& simulation, HostConfig& config);

  /// Call after every poll of the session's host, with what it returned.
  void after_poll(Host& host, bool produced, std::int64_t now_ns);
  /// Changes the interval, which is in its range, from the next checkpoint on.
  void set_interval(double interval_s) { keeper_->set_interval(interval_s); }
  /// Writes a last checkpoint, if a frame was made, none is under way, and the session was not another
  /// server's.
  void end(const Host& host);
  /// Empty without a folder.
  [[nodiscard]] std::optional<checkpoint::Figures> figures() const { return keeper_->figures(clock_ns_()); }

 private:
  void tell(std::int64_t now_ns);

  std::unique_ptr<checkpoint::Keeper> keeper_;
  Log log_;
  std::int64_t (*clock_ns_)();
  bool ran_ = false;     // a frame was made
  bool serves_ = false;  // servers stand by
};

}  // namespace tandem::host
