#pragma once
// What a server needs from a full simulation. Implement engine::Simulation, and tandem/host.hpp streams it.
// An engine needs no other header of Tandem.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::engine {

using Vec3 = std::array<double, 3>;

inline constexpr std::uint32_t kMaxBodies = 1U << 22U;  ///< maximum number of bodies of a simulation
inline constexpr std::uint32_t kMovedSlots = 16384;     ///< slots of a block of Simulation::moved()

enum class InputKind : std::uint32_t {
  kGravity = 1,  ///< values: x, y, z in scene units / s^2; also changes the predicted step
  /// values: centre x, y, z; radius; velocity change x, y, z. It acts on bodies whose centre is within the
  /// radius. If bodies turn, it is an impulse: mass times velocity change, at the point of the body's surface
  /// that is nearest to the push's centre. A push that is off the body's centre therefore turns the body too.
  kPush = 2,
  kSeek = 3,          ///< values: seconds into a recording; simulations refuse it
  kApplication = 16,  ///< bytes whose meaning only the engine knows
};

struct Input {
  std::uint32_t kind = 0;  ///< InputKind; classify() refuses unknown values
  std::vector<double> values = {};
  std::vector<std::byte> bytes = {};
};

/// How an input takes effect (thesis, section 4.2.1), and how it changes the predicted step.
struct Classification {
  enum class Effect : std::uint8_t { kScheduled, kImmediate, kRefused };
  Effect effect = Effect::kRefused;
  std::string reason = {};   ///< kRefused: the reason, one line
  Vec3 gravity{};            ///< kScheduled: scene units / s^2, in force from the frame the input acts on
  double damping_per_s = 0;  ///< kScheduled
  double cost = 0;           ///< kImmediate: what the input takes of its sender's InputBudget, >= 0
};

/// What the immediate inputs of one participant may cost, in a unit that the simulation chooses. The server
/// refuses an input that costs more than is left.
struct InputBudget {
  double per_second = 0;  ///< comes back
  double most = 0;        ///< maximum that is saved up, and what a participant begins with; 0: no limit
};

/// The bodies after a step, in slot order, as columns of `capacity` elements. Units: scene units, seconds.
/// Valid until the next step(). Values of dead slots are unspecified. The two optional groups are both
/// present or both absent, the same in every frame. If a streamed column changes its length, the session ends
/// with an error.
struct Bodies {
  std::array<std::span<const float>, 3> position;
  std::array<std::span<const float>, 3> velocity;
  std::span<const std::uint8_t> alive;
  std::span<const std::uint16_t> type;
  /// Optional; empty: bodies do not turn. Quaternion x, y, z, w from body to world, norm within 1e-3 of 1.
  std::array<std::span<const float>, 4> orientation{};
  /// Optional, together with orientation. World frame, rad / s; at most kMaxTurn in a step.
  std::array<std::span<const float>, 3> angular_velocity{};
  /// The bodies' own data, where the server declares some (ServerOptions::data): a record for each slot, its
  /// fields in their order without gaps, little-endian. Otherwise ignored.
  std::span<const std::byte> data{};
};

/// Maximum angle that a body may turn in a step, rad; engines clamp faster bodies.
inline constexpr double kMaxTurn = 2;

/// A change of a slot in the last step. Events are ascending by slot; for one slot, despawned comes before
/// spawned.
struct Event {
  enum class Kind : std::uint8_t { kDespawned, kSpawned, kTeleported, kTypeChanged };
  Kind kind = Kind::kSpawned;
  std::uint32_t slot = 0;
};

/// The name of the body that is in a slot now, for people.
struct BodyName {
  std::uint32_t slot = 0;
  std::string name = {};  ///< UTF-8; clients are told the first 64 bytes, control characters become '?'
};

/// Bodies that an engine repaired since its start so that the session could go on: rigid bodies sometimes
/// explode.
struct Mishaps {
  std::uint64_t removed = 0;  ///< bodies whose values were no longer numbers, or that left the world
  std::uint64_t clamped = 0;  ///< number of times a body turned by more than kMaxTurn in a step

  friend bool operator==(const Mishaps&, const Mishaps&) = default;
};

/// What a session tells beside bodies: keys with values, and events.
struct NewsFeatures {
  bool keys = false, events = false;
};

/// Takes the keys and events of a step. What they are and their limits: Server::set_key(), remove_key() and
/// broadcast() in tandem/host.hpp. What breaks a limit is refused and nothing else happens: the function
/// returns false, and the server's log counts it and names the last one.
class StepNews {
 public:
  virtual bool set_key(std::string_view key, std::span<const std::byte> value) = 0;
  virtual bool remove_key(std::string_view key) = 0;
  virtual bool broadcast(std::uint32_t kind, std::span<const std::byte> bytes = {},
                         std::optional<std::uint32_t> slot = {}) = 0;

 protected:
  ~StepNews() = default;
};

/// A full simulation. It is deterministic: the same inputs on the same frames give the same bodies to the
/// last bit, on any number of threads. An engine that guarantees this only on one machine says so. The
/// simulation is called from one thread; it may use others inside step().
class Simulation {
 public:
  virtual ~Simulation() = default;

  [[nodiscard]] virtual std::uint32_t capacity() const = 0;
  /// Seconds of one step.
  [[nodiscard]] virtual double dt_s() const = 0;
  /// The gravity in force: the next step uses it unless an input changes it.
  [[nodiscard]] virtual Vec3 gravity() const = 0;
  /// 1/s: a body loses damping_per_s * dt_s of its velocity in a step.
  [[nodiscard]] virtual double damping_per_s() const { return 0; }

  /// Decides how an input takes effect, without applying it. An override must refuse values that are not
  /// finite or out of range. The default refuses all inputs.
  [[nodiscard]] virtual Classification classify(const Input& /*input*/) const {
    return {.reason = "this simulation takes no input"};
  }
  /// The limit of what Classification::cost counts. It does not change.
  [[nodiscard]] virtual InputBudget input_budget() const { return {}; }
  /// Hands over an input that classify() did not refuse. It takes effect in the next step(). The last gravity
  /// wins.
  virtual void apply(const Input& /*input*/) {}
  virtual void step() = 0;

  // A step that can be waited for, for an engine that computes elsewhere. The server goes on with its clients
  // while such a step is under way. Meanwhile it calls only classify(), input_budget(), step_ready(),
  // step_descriptor() and failure().

  /// Begins a step and returns soon. The default makes the step.
  virtual void begin_step() { step(); }
  /// True if the step that was begun is finished, or failure() says why it never will be.
  [[nodiscard]] virtual bool step_ready() { return true; }
  /// A file descriptor that becomes readable when step_ready() may have changed; -1: none, and the server
  /// asks once a millisecond.
  [[nodiscard]] virtual int step_descriptor() const { return -1; }
  /// Why there will be no further step, in one line; empty: there will be. The session then ends with it. The
  /// server asks often, also between steps.
  [[nodiscard]] virtual std::string failure() { return {}; }

  [[nodiscard]] virtual Bodies bodies() const = 0;
  /// Events of the last step; valid until the next one.
  [[nodiscard]] virtual std::span<const Event> events() const { return {}; }
  /// Optional: one byte for each block of kMovedSlots slots, the last perhaps shorter. 0: nothing of these
  /// slots in bodies() is other than before the last step (or load()), to the bit, so the server need not
  /// read them. An engine whose bodies fall asleep saves it about 4 ns a body so. Empty: not known. Valid
  /// until the next step().
  [[nodiscard]] virtual std::span<const std::uint8_t> moved() const { return {}; }
  /// What tell() may tell. Asked before the session starts, which has these features then, and does not
  /// change.
  [[nodiscard]] virtual NewsFeatures tells() const { return {}; }
  /// Tells the keys and events of the last step (contact began, goal, score); clients hear of them with its
  /// frame. Called at most once a step, after it and before the next one, if the session has a feature.
  virtual void tell(StepNews& /*news*/) {}
  /// Number of bodies in contact with another body or the scene in the last step, for the thesis's tables.
  [[nodiscard]] virtual std::uint32_t colliding() const { return 0; }
  [[nodiscard]] virtual Mishaps mishaps() const { return {}; }

  /// The names of bodies, in any order. A body that is not listed has no name; of two names for a slot the
  /// first counts; the 65,535 lowest slots are told. The host asks at the start, and then at most once a
  /// second: after a body appeared, and when names_version() changed.
  [[nodiscard]] virtual std::vector<BodyName> names() const { return {}; }
  /// Another value tells that names() changed although no body appeared.
  [[nodiscard]] virtual std::uint64_t names_version() const { return 0; }

  /// A checkpoint holds everything that decides the following steps. load() returns false and changes nothing
  /// if the bytes are not a checkpoint of this simulation. After load(), bodies(), gravity and waiting inputs
  /// are as they were at save(). The following steps are valid. Their bits may differ from those of the run
  /// that saved, because an engine may rebuild caches that it keeps from step to step (contact points,
  /// impulses to start from). Two loads of the same bytes continue identically.
  virtual void save(std::vector<std::byte>& /*out*/) const {}
  [[nodiscard]] virtual bool load(std::span<const std::byte> /*bytes*/) { return false; }
};

}  // namespace tandem::engine
