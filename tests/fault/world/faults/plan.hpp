#pragma once
// What goes wrong in a world: a list of values, drawn from the seed before the world begins.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::world {

enum class FaultKind : std::uint8_t {
  kCrash,  ///< the process is killed, and started again after the duration
  kLeave,  ///< it ends in order, and is started again after the duration
  kPower,  ///< the server's machine loses its power; `strength`: the share of what was not synced that stays
  kTornWrite,  ///< the same in the middle of the next write of a checkpoint
  kPause,
  kPartition,  ///< between two of them
  kOneWay,     ///< from one to another
  kIsolate,    ///< from all others
  kLoss,       ///< `strength`: share of samples
  kDelay,      ///< `strength`: seconds
  kReorder,    ///< jitter, `strength`: seconds
  kDuplicate,
  kThin,      ///< a bottleneck of 100 to 1000 kbit/s
  kFlip,      ///< bits of deltas and snapshots
  kTruncate,  ///< deltas and snapshots; mostly on a long link that loses
  kForge,     ///< a participant of the session sends arbitrary samples under all names
  kSlowDisk,  ///< `strength`: seconds for a checkpoint
  kFullDisk,
  kLostFsync,
  kWallJump,  ///< `strength`: seconds, ahead or back
  kDrift,     ///< of the steady clock, `strength`: share
  kStarve,    ///< the thread runs only now and then, `strength`: seconds between
  kStarvePublisher,
  kBurst,        ///< of inputs, `strength`: number
  kNewcomer,     ///< another client joins, and leaves after the duration
  kQuality,      ///< the operator sets other parameters
  kPreference,   ///< a client prefers another stream
  kLostForGood,  ///< what is lost is not repaired, `strength`: share; in worlds where nobody starts anew
  kHandover,     ///< an operator asks the live server to hand over, until it has heard it
  kHang,         ///< a server's thread stands still, and its network goes on
  kRepeat,       ///< a client sends its last input again
  kLastWords,    ///< a burst of inputs of everybody, and after the duration the live server is killed
  kSquat,        ///< until the world ends, a participant says it is each client that a server knows
  kEngineDies,   ///< of a server whose engine is another process
  kEngineStops,  ///< for longer than its limit, or shorter
};
inline constexpr std::size_t kFaultKinds = 35;
[[nodiscard]] const char* name_of(FaultKind kind);

struct Fault {
  std::uint32_t id = 0;  ///< place in the plan as it was drawn
  std::int64_t at_ms = 0;
  FaultKind kind = FaultKind::kCrash;
  std::uint32_t whom = 0, other = 0;  ///< actors, modulo their number
  std::int64_t for_ms = 0;
  double strength = 0;
  std::uint64_t salt = 0;
};
[[nodiscard]] std::string text_of(const Fault& fault);

using Plan = std::vector<Fault>;

struct PlanWishes {
  std::int64_t from_ms = 0, until_ms = 0;
  std::vector<FaultKind> kinds;  ///< what may be drawn
};
/// Draws which kinds there are in this world (swarm testing), how often, and each fault; ascending by time.
[[nodiscard]] Plan draw_plan(std::uint64_t seed, const PlanWishes& wishes);

/// Reads names of kinds, separated by commas; "none" and "all". Errors: kInvalidArgument.
[[nodiscard]] Result<std::vector<FaultKind>> read_kinds(std::string_view text);

}  // namespace tandem::world
