#pragma once
// Lets the faults of a plan happen, and ends them.

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "tests/fault/world/actors/actor.hpp"
#include "tests/fault/world/actors/forger.hpp"
#include "tests/fault/world/actors/server.hpp"
#include "tests/fault/world/faults/plan.hpp"

namespace tandem::world {

/// Whom faults happen to: the server is the first.
using Cast = std::vector<std::unique_ptr<Actor>>;

class Chaos {
 public:
  /// Faults end at `heal_at_ns`, the latest, but for squatters. All must outlive it.
  Chaos(Stage& stage, Cast& cast, std::size_t newcomers_from, const Plan& plan, std::int64_t heal_at_ns);

  /// The time at which turn() has something to do.
  [[nodiscard]] std::int64_t wake_ns() const;
  /// Begins and ends what is due at the stage's time.
  void turn();

 private:
  struct Active {
    Fault fault;
    std::int64_t until_ns = 0;
    std::unique_ptr<Forger> forger = {};
    std::unique_ptr<transport::simulated::CommandPort> operates = {};
    std::int64_t speaks_at_ns = INT64_MAX;  ///< the forger or the operator
    std::shared_ptr<transport::simulated::Bottleneck> bottleneck = {};
  };
  void begin(const Fault& fault);
  void end(const Active& active);
  void speak(Active& active);
  void heal();
  [[nodiscard]] std::size_t index_of(std::uint32_t whom) const;
  [[nodiscard]] Actor& actor(std::uint32_t whom) { return *cast_[index_of(whom)]; }
  [[nodiscard]] std::size_t other_than(const Fault& fault) const;
  /// Whom a fault of servers hits: the first one, if not another.
  [[nodiscard]] std::size_t server_index(std::uint32_t whom) const;
  [[nodiscard]] Server& server(std::uint32_t whom);
  [[nodiscard]] Server* live_server();  ///< null: none
  void each_server(const std::function<void(Server&)>& change);
  /// True if a fault of the network changes the way from one to another.
  [[nodiscard]] bool concerns(const Active& active, std::size_t from, std::size_t to) const;
  void set_links();
  void disturb(const Active& active);

  Stage& stage_;
  Cast& cast_;
  std::size_t newcomers_from_;
  const Plan& plan_;
  std::int64_t heal_at_ns_;
  std::size_t next_ = 0;
  bool healed_ = false;
  std::vector<Active> active_;
  std::uint64_t links_of_ = UINT64_MAX;  // Stage::changes when links were set
};

}  // namespace tandem::world
