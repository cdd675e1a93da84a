#pragma once
// What --metrics tells of an engine in another process.

#include <cstdint>
#include <string>

#include "sdk/statistics/duration_buckets.hpp"
#include "services/engines/door/door.hpp"
#include "services/program/metrics/page.hpp"

namespace tandem::daemon {

/// Figures of a moment.
struct EngineNow {
  enum class State : std::uint8_t { kAwaited, kServes, kSlow, kStopped };
  std::string name;
  State state = State::kAwaited;
  std::uint64_t restarts = 0;                     ///< engines after the first one
  DurationBuckets::Counts round_trip, step_took;  ///< of all engines; as they say themselves
};
void describe(metrics::Page& page, const EngineNow& engine);

/// Follows the engines of a server, one after the other. Not thread-safe.
class EngineWatch {
 public:
  /// Another engine serves. It has to be there until the next call of this or of lost().
  void begin(const engine::door::Door& door);
  void lost();
  /// Call after each frame that was made.
  void count_step();
  [[nodiscard]] EngineNow now() const;

 private:
  const engine::door::Door* door_ = nullptr;
  bool began_ = false;
  EngineNow counted_;
};

}  // namespace tandem::daemon
