#pragma once
// The server: host, engine, checkpoints on a disk that may fail.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/host/checkpoint/keeper.hpp"
#include "services/host/host.hpp"
#include "services/host/keeping/keeping.hpp"
#include "services/host/standby/standby.hpp"
#include "tests/fault/world/actors/actor.hpp"
#include "tests/fault/world/actors/engine.hpp"
#include "tests/support/disk/simulated_disk.hpp"

namespace tandem::world {

class Server final : public Actor {
 public:
  /// `rank`: of one that is started to stand by, each time; 0: it is started as the live one.
  Server(Stage& stage, std::string name, transport::ClientId standby_id, std::uint32_t rank = 0);
  ~Server() override;

  // What the faults do.
  void set_disk_delay(std::int64_t ns);
  void set_disk_full(bool full) override;
  void set_disk_lies(bool lies);
  /// The power fails in one of the steps of the next write.
  void tear_next_write(std::uint64_t salt, double kept, std::int64_t back_after_ns);
  void keep_next_write_whole() { tear_.reset(); }
  void set_publishing(bool publishing);
  void change_quality(std::uint64_t salt);
  void kill_engine();
  void set_engine_stopped(bool stopped);
  void set_power_kept(double kept) { power_kept_ = kept; }

  [[nodiscard]] std::vector<transport::ParticipantId> participants() const override;
  [[nodiscard]] const host::Host* host() const { return host_.get(); }
  void check() override;
  /// True if the other one has to wait for it before it takes over from the server of `epoch`.
  [[nodiscard]] bool comes_before(const Server& other, Epoch epoch) const;
  /// It makes frames, or would.
  [[nodiscard]] bool runs() const;

 protected:
  void on_start() override;
  void on_crash(bool power_fails) override;
  void on_leave() override;
  void on_poll() override;
  [[nodiscard]] std::int64_t due_ns() const override;

 private:
  void begin();
  void stand_by();
  void take_over();
  void call_operator();
  void check_takeover(const standby::Takeover& takeover, Frame from) const;
  [[nodiscard]] std::uint32_t rank() const { return rank_ == 0 ? 5 : rank_; }
  void begin_host(host::HostConfig config);
  void check_start(const checkpoint::Start& start);
  void note_frame();
  [[nodiscard]] std::int64_t longest_wait_ns() const;
  void note_acts();
  void write_checkpoint();
  void check_folder();
  [[nodiscard]] std::unique_ptr<WatchedEngine> make_engine() const;
  /// Ends with its engine, if that failed, and is started again with another one.
  bool ends_with_engine();
  void drop();
  void lose_power(double kept);
  [[nodiscard]] std::optional<checkpoint::Moment> newest_on_disk() const;

  std::shared_ptr<checkpoint::SimulatedDisk> disk_;
  std::int64_t disk_delay_ns_ = 2 * kMs;
  double power_kept_ = 0;
  bool disk_sound_ = true;            ///< it has kept its promises since the world began
  std::int64_t disk_trouble_ns_ = 0;  ///< until when it was slow, full or lied
  struct Tear {
    std::uint64_t step = 0;
    double kept = 0;
    std::int64_t back_after_ns = 0;
  };
  std::optional<Tear> tear_;

  std::unique_ptr<transport::ServerPort> port_;
  std::unique_ptr<WatchedEngine> engine_;
  std::unique_ptr<standby::Standby> standby_;  ///< while it stands by
  std::optional<host::Keeping> keeping_;       ///< while there is a host
  std::unique_ptr<checkpoint::Keeper> made_;   ///< until then
  checkpoint::Keeper* keeper_ = nullptr;       ///< of either
  std::unique_ptr<host::Host> host_;
  std::optional<std::int64_t> write_at_ns_;
  bool publishing_ = true;
  const std::uint32_t rank_;
  bool swapped_ = false;  ///< another server has the session, so this one stands by at its next start
  transport::ClientId standby_id_;
  std::int64_t no_live_since_ns_ = 0;
  Epoch epoch_ = 0;
  std::size_t acts_seen_ = 0;
  std::int64_t last_frame_ns_ = 0, last_poll_ns_ = 0;
  host::Host::State told_state_ = host::Host::State::kClaiming;

  std::vector<transport::ClientId> taken_over_;

  // Of the life before, for the next start.
  struct Before {
    Epoch epoch = 0;
    Frame frame = 0;
    std::int64_t frame_ns = 0;
    bool orderly = false;
    bool sound = false;  ///< nothing was wrong with server and disk for long enough
  };
  std::optional<Before> before_;
};

/// What everybody else sees of the servers: the one that is live, if there is only one.
class Service {
 public:
  explicit Service(const Stage& stage) : stage_(stage) {}
  /// Call after each turn of the world.
  void look();
  /// How long that one has been there, and nothing was wrong with it; 0 while there is none or another.
  [[nodiscard]] std::int64_t serves_for_ns() const;
  /// Precondition: serves_for_ns() is above 0.
  [[nodiscard]] const host::Host* host() const { return live_->host(); }

 private:
  const Stage& stage_;
  const Server* live_ = nullptr;
  Epoch epoch_ = 0;
  std::int64_t since_ns_ = 0;
};

}  // namespace tandem::world
