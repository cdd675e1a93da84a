#pragma once
// What a server needs from a full simulation: implement engine::Simulation, and tandem/host.hpp streams it.
// Engines see nothing else of Tandem.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tandem::engine {

using Vec3 = std::array<double, 3>;

inline constexpr std::uint32_t kMaxBodies = 1U << 20U;  ///< of a simulation

enum class InputKind : std::uint32_t {
  kGravity = 1,  ///< values: x, y, z in scene units / s^2; changes the predicted step too
  /// values: centre x, y, z; radius; velocity change x, y, z. Acts on bodies whose centre is within the
  /// radius. Where bodies turn it is an impulse, mass times velocity change, at the point of the body's
  /// surface that is nearest to the centre, so that a push off the middle turns the body too.
  kPush = 2,
  kSeek = 3,          ///< values: seconds into a recording; no simulation takes it
  kApplication = 16,  ///< bytes whose meaning only the engine knows
};

struct Input {
  std::uint32_t kind = 0;  ///< InputKind; unknown values are refused by classify()
  std::vector<double> values = {};
  std::vector<std::byte> bytes = {};
};

/// How an input takes effect (paper, section 4.2.1), and what it makes of the predicted step.
struct Classification {
  enum class Effect : std::uint8_t { kScheduled, kImmediate, kRefused };
  Effect effect = Effect::kRefused;
  std::string reason = {};   ///< kRefused: one line
  Vec3 gravity{};            ///< kScheduled: scene units / s^2, in force from the frame the input acts on
  double damping_per_s = 0;  ///< kScheduled
};

/// The bodies after a step, in slot order, structure of arrays, each `capacity` long; scene units and per
/// second. Valid until the next step(). Values of dead slots are unspecified. Either both of the optional
/// groups are there or none, in every frame the same. Where a column that is streamed has another length
/// after a step, the session ends with an error.
struct Bodies {
  std::array<std::span<const float>, 3> position;
  std::array<std::span<const float>, 3> velocity;
  std::span<const std::uint8_t> alive;
  std::span<const std::uint16_t> type;
  /// Optional, empty: bodies do not turn. Quaternion x, y, z, w from body to world, norm within 1e-3 of 1.
  std::array<std::span<const float>, 4> orientation{};
  /// Optional, with orientation. World frame, rad / s; at most kMaxTurn in a step.
  std::array<std::span<const float>, 3> angular_velocity{};
};

/// Most that a body may turn in a step, rad; engines clamp what is faster.
inline constexpr double kMaxTurn = 2;

/// A change of a slot in the last step, ascending by slot; for one slot, despawned before spawned.
struct Event {
  enum class Kind : std::uint8_t { kDespawned, kSpawned, kTeleported, kTypeChanged };
  Kind kind = Kind::kSpawned;
  std::uint32_t slot = 0;
};

/// Bodies that an engine mended since its start so that the session goes on: rigid bodies explode now and
/// then.
struct Mishaps {
  std::uint64_t removed = 0;  ///< not a number any more, or out of the world
  std::uint64_t clamped = 0;  ///< times one turned by more than kMaxTurn in a step

  friend bool operator==(const Mishaps&, const Mishaps&) = default;
};

/// A full simulation. Deterministic: same inputs on the same frames give the same bodies to the last bit, on
/// any number of threads; an engine that promises this for one machine only says so. Called from one thread;
/// it may use others inside step().
class Simulation {
 public:
  virtual ~Simulation() = default;

  [[nodiscard]] virtual std::uint32_t capacity() const = 0;
  /// Seconds a step.
  [[nodiscard]] virtual double dt_s() const = 0;
  /// In force now: the drive of the next step unless an input changes it.
  [[nodiscard]] virtual Vec3 gravity() const = 0;
  /// 1/s: a body loses damping_per_s * dt_s of its velocity in a step.
  [[nodiscard]] virtual double damping_per_s() const { return 0; }

  /// Decides what an input is, without applying it. Refuses what is not finite or out of range; all, unless
  /// overridden.
  [[nodiscard]] virtual Classification classify(const Input& /*input*/) const {
    return {.reason = "this simulation takes no input"};
  }
  /// Takes effect in the next step(). The last gravity wins. Only inputs that classify() did not refuse.
  virtual void apply(const Input& /*input*/) {}
  virtual void step() = 0;

  [[nodiscard]] virtual Bodies bodies() const = 0;
  /// Of the last step; valid until the next one.
  [[nodiscard]] virtual std::span<const Event> events() const { return {}; }
  /// Bodies in contact (with another body or with the scene) in the last step, for the paper's tables.
  [[nodiscard]] virtual std::uint32_t colliding() const { return 0; }
  [[nodiscard]] virtual Mishaps mishaps() const { return {}; }

  /// Checkpoint: everything that decides the following steps. load() returns false and changes nothing when
  /// the bytes are not a checkpoint of this simulation. After it, bodies(), gravity and waiting inputs are
  /// what they were at save(). The steps that follow are valid, but an engine that keeps caches from step to
  /// step (contact points, impulses to start from) may rebuild them, so that its bits need not be those of
  /// the run that saved; two loads of the same bytes go on alike.
  virtual void save(std::vector<std::byte>& /*out*/) const {}
  [[nodiscard]] virtual bool load(std::span<const std::byte> /*bytes*/) { return false; }
};

}  // namespace tandem::engine
