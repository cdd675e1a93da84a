#pragma once
// The engine as another process: its steps take a while, it may be stopped, and it may die.

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/fault/world/actors/engine.hpp"
#include "tests/fault/world/stage.hpp"

namespace tandem::world {

/// What services/engines/door is to a host, without process and socket. Throws if the host asks for what it
/// may not while a step is under way.
class DoorEngine final : public WatchedEngine {
 public:
  static constexpr std::int64_t kLimitNs = 2 * kSecond;  // for a step

  explicit DoorEngine(const Stage& stage) : WatchedEngine(stage.settings.scene), stage_(stage) {}

  void die() override { why_ = "the engine hung up in frame " + std::to_string(frame + 1); }
  void set_stopped(bool stopped) override { stopped_ = stopped; }

  bool finish_step() override {
    took_ns_ = 0;
    return !stopped_ && why_.empty();
  }

  void apply(const engine::Input& input) override {
    require_idle("gives it an input");
    waiting_.push_back(input);
  }
  void begin_step() override {
    require_idle("asks for another step");
    under_way_ = true;
    asked_ns_ = stage_.now_ns;
    // From nothing to a quarter of a frame, or from a half to 1.1 frames.
    const auto share = 1e-3 * static_cast<double>((frame + 1) * 2'654'435'761U % 1000);
    const bool slow = has_slow_engine(stage_.settings.seed) && (frame + 1) / 128 % 2 == 1;
    took_ns_ = static_cast<std::int64_t>(dt_s() * 1e9 * (slow ? 0.5 + 0.6 * share : 0.25 * share));
  }
  [[nodiscard]] bool step_ready() override {
    if (!under_way_ || !failure().empty()) return true;
    if (stopped_ || stage_.now_ns < asked_ns_ + took_ns_) return false;
    finish();
    return true;
  }
  void step() override {
    begin_step();
    finish();
  }
  [[nodiscard]] std::string failure() override {
    if (why_.empty() && under_way_ && stage_.now_ns > asked_ns_ + kLimitNs)
      why_ = "the engine did not answer for 2 s in frame " + std::to_string(frame + 1);
    return why_;
  }
  [[nodiscard]] engine::Bodies bodies() const override {
    require_idle("reads its bodies");
    return WatchedEngine::bodies();
  }
  [[nodiscard]] std::span<const engine::Event> events() const override {
    require_idle("reads its events");
    return WatchedEngine::events();
  }
  void save(std::vector<std::byte>& out) const override {
    out.clear();
    if (!under_way_ && why_.empty()) WatchedEngine::save(out);
  }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override {
    if (under_way_ && why_.empty()) finish();
    return why_.empty() && WatchedEngine::load(bytes);
  }

 private:
  void finish() {
    for (const engine::Input& input : std::exchange(waiting_, {})) WatchedEngine::apply(input);
    WatchedEngine::step();
    under_way_ = false;
  }
  void require_idle(const char* what) const {
    if (under_way_ && why_.empty())
      throw std::runtime_error(std::string("the host ") + what + " while a step is under way");
  }

  const Stage& stage_;
  std::vector<engine::Input> waiting_;
  std::string why_;
  bool under_way_ = false, stopped_ = false;
  std::int64_t asked_ns_ = 0, took_ns_ = 0;
};

}  // namespace tandem::world
