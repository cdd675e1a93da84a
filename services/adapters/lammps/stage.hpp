// SPDX-License-Identifier: MIT
#pragma once
// One script in front of one server: the conversation of idl/ENGINE.md on the first rank, its orders on all.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "services/adapters/lammps/options.hpp"
#include "services/adapters/lammps/ranks.hpp"
#include "services/adapters/lammps/script.hpp"
#include "services/adapters/lammps/slots.hpp"
#include "services/adapters/lammps/world.hpp"

struct tandem_engine;

namespace tandem_lammps {

/// All ranks make one and call play().
class Stage {
 public:
  /// Executes the script up to its first run. Throws Refusal.
  Stage(void* lammps, const Ranks& ranks, const LammpsOptions& options);
  ~Stage();
  /// Connects, and answers until the server or the script's author ends it. Gives an exit code.
  int play();

 private:
  struct Order;
  [[nodiscard]] std::string hello() const;
  bool open();
  Order next_order();
  void obey(const Order& order);
  void step();
  void save(const std::string& path);
  void load(const std::string& path);
  void write_columns();
  std::span<const std::uint32_t> assign(const std::vector<Row>& rows);
  void renew_what_crossed(const std::vector<Row>& rows, std::span<const std::uint32_t> slots);
  void say_pace() const;
  void say_times();

  void* lammps_;
  const Ranks& ranks_;
  const LammpsOptions& options_;
  Script script_;
  std::unique_ptr<LammpsWorld> world_;
  std::unique_ptr<Slots> slots_;
  std::unique_ptr<tandem_engine> engine_;  // of the first rank
  std::vector<std::int64_t> ids_ = {};
  std::vector<float> before_ = {};  // positions of the frame before, if the box is periodic
  std::uint64_t steps_ = 0, lost_ = 0;
  bool over_ = false;
  std::vector<float> steps_ms_ = {}, gather_ms_ = {}, hand_over_ms_ = {};  // of the first rank's last frames
};

}  // namespace tandem_lammps
