#pragma once
// The way of a simulation's keys and events to the desk.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "sdk/wire/units.hpp"
#include "services/host/news/news_desk.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

/// Asks a simulation for what it tells of a step, and counts what the desk refuses of it. Not thread-safe.
class SimulationNews final : private engine::StepNews {
 public:
  /// Hands on the news of the last step, which made that frame.
  void ask(engine::Simulation& simulation, NewsDesk& desk, Frame frame);

  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  /// What was refused since the last call that returned a line, at most once in ten seconds.
  [[nodiscard]] std::optional<std::string> take_warning(std::int64_t now_ns);

 private:
  bool set_key(std::string_view key, std::span<const std::byte> value) override;
  bool remove_key(std::string_view key) override;
  bool broadcast(std::uint32_t kind, std::span<const std::byte> bytes,
                 std::optional<std::uint32_t> slot) override;
  bool note(const Result<void>& result, std::string_view what);

  NewsDesk* desk_ = nullptr;  // while ask() runs
  Frame frame_ = 0;
  std::uint64_t refused_ = 0, told_ = 0;
  std::string last_;
  std::int64_t told_ns_ = std::numeric_limits<std::int64_t>::min() / 2;
};

}  // namespace tandem::host
