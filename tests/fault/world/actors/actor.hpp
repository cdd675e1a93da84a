#pragma once
// A process of the world, on a machine of its own, and what can happen to it.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/wire/port.hpp"
#include "tests/fault/world/stage.hpp"

namespace tandem::world {

class Actor {
 public:
  Actor(Stage& stage, std::string name);
  virtual ~Actor() = default;
  Actor(const Actor&) = delete;
  Actor& operator=(const Actor&) = delete;

  // What the faults do.
  void start();
  void crash(std::int64_t back_at_ns, bool power_fails = false);
  void leave(std::int64_t back_at_ns);
  void set_paused(bool paused);
  /// The thread stands still, and all that DDS does by itself goes on.
  void set_hung(bool hung);
  /// The thread runs only so often; 0: whenever it wants.
  void set_starved(std::int64_t between_ns);
  virtual void burst(std::uint32_t /*inputs*/) {}
  virtual void repeat() {}
  virtual void prefer(std::uint64_t /*salt*/) {}
  virtual void set_disk_full(bool /*full*/) {}

  /// Does what is due at the stage's time.
  void turn();
  /// The time of the world at which turn() has something to do even if nothing arrives.
  [[nodiscard]] std::int64_t wake_ns() const;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] bool up() const { return up_; }
  /// It does nothing for now.
  [[nodiscard]] bool paused() const { return paused_ || hung_; }
  [[nodiscard]] Clock& clock() { return clock_; }
  [[nodiscard]] const Clock& clock() const { return clock_; }
  /// The DDS participants that are up.
  [[nodiscard]] virtual std::vector<transport::ParticipantId> participants() const = 0;
  /// Called once a while: blames what is not as the rules want it.
  virtual void check() {}
  /// Called at the end of the world, with everybody else still there.
  virtual void check_end() {}
  /// Something was wrong with it, or with the way to it, until now.
  void disturb() { disturbed_ns_ = stage_.now_ns; }
  /// For how long nothing was wrong with it.
  [[nodiscard]] std::int64_t well_for_ns() const { return stage_.now_ns - disturbed_ns_; }

 protected:
  virtual void on_start() = 0;
  /// The process is gone; its participants are killed already.
  virtual void on_crash(bool power_fails) = 0;
  virtual void on_leave() = 0;
  virtual void on_poll() = 0;
  /// The time of the world at which something arrives that is not a sample.
  [[nodiscard]] virtual std::int64_t arrival_ns() const { return INT64_MAX; }
  /// In the actor's steady time.
  [[nodiscard]] virtual std::int64_t due_ns() const = 0;

  [[nodiscard]] std::int64_t steady_ns() const { return clock_.steady_ns(stage_.now_ns); }
  [[nodiscard]] std::int64_t wall_ns() const { return clock_.wall_ns(stage_.now_ns); }
  void tell(std::string what) const { stage_.journal.add(stage_.now_ns, name_, std::move(what)); }
  void blame(const char* invariant, std::string what) const {
    stage_.blame(invariant, name_, std::move(what));
  }
  /// For an actor that ends by itself, as a service that is started again.
  void ended(std::int64_t back_at_ns);

  Stage& stage_;

 private:
  [[nodiscard]] std::uint64_t delivered() const;

  std::string name_;
  Clock clock_;
  bool up_ = false, paused_ = false, hung_ = false;
  std::int64_t back_at_ns_ = INT64_MAX;
  std::int64_t starved_ns_ = 0, not_before_ns_ = 0;
  std::int64_t disturbed_ns_ = 0;
  std::uint64_t delivered_ = 0;
};

}  // namespace tandem::world
