#pragma once
// IMD, the protocol by which molecular dynamics shows itself to a viewer: messages as values, and their
// bytes. Pure.
//
// Version 3 is that of the repository Becksteinlab/imdclient (docs/source/protocol_v3.rst). Version 2, which
// LAMMPS, GROMACS and NAMD of before 2025 speak, has no time, no box, no velocities and no session info, and
// PAUSE is a toggle.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::imd {

enum class Type : std::int32_t {
  kDisconnect = 0,
  kEnergies = 1,
  kCoordinates = 2,
  kGo = 3,
  kHandshake = 4,
  kKill = 5,
  kForcesIn = 6,  ///< MDCOMM
  kPause = 7,
  kRate = 8,
  kIoError = 9,
  kSessionInfo = 10,
  kResume = 11,
  kTime = 12,
  kBox = 13,
  kVelocities = 14,
  kForces = 15,
  kWait = 16,
};

inline constexpr std::size_t kHeadBytes = 8;

/// What an engine says of itself at the start.
struct Session {
  int version = 0;
  bool swapped = false;  ///< bodies are in the other byte order than this machine's
  bool time = false, energies = false, box = false, coordinates = false, wrapped = false, velocities = false,
       forces = false;
};

struct Moment {
  double dt = 0, time = 0;  ///< of the engine: picoseconds by the protocol
  std::int64_t step = 0;
};

/// A whole frame. Positions and velocities are x, y, z of each atom in turn.
struct Frame {
  std::uint64_t number = 0;  ///< from 1, counted here
  std::vector<float> positions, velocities;
  std::optional<Moment> moment = {};
  std::optional<std::array<float, 9>> box = {};  ///< three vectors
};

/// Reads what an engine sends. Nothing that it sends makes it hold more than a frame and a message. Not
/// thread-safe.
class EngineReader {
 public:
  explicit EngineReader(std::uint32_t atoms) : atoms_(atoms) {}

  /// Takes bytes in any pieces. Calls `on_session` once, when GO may be sent, and `on_frame` for each whole
  /// frame, which may be swapped away. Errors: kMalformed, kUnsupported, kCapacity, with a line that says
  /// what came and what was expected; nothing further can be read then. kTransport: the engine said that it
  /// ends.
  [[nodiscard]] Result<void> take(std::span<const std::byte> bytes,
                                  const std::function<void(const Session&)>& on_session,
                                  const std::function<void(Frame&)>& on_frame);
  [[nodiscard]] const Session& session() const { return session_; }

 private:
  enum class State : std::uint8_t { kHandshake, kSessionInfo, kFrames };
  Result<std::size_t> body_bytes() const;
  Result<void> take_message(std::span<const std::byte> body,
                            const std::function<void(const Session&)>& on_session,
                            const std::function<void(Frame&)>& on_frame);
  Result<void> take_handshake();
  Result<void> in_order(Type type);
  [[nodiscard]] Type last_of_frame() const;
  template <class T>
  void copy(std::span<const std::byte> body, T* to, std::size_t count) const;

  std::uint32_t atoms_;
  State state_ = State::kHandshake;
  Session session_ = {};
  Type type_ = Type::kIoError;
  std::int32_t count_ = 0;
  bool has_head_ = false;
  std::vector<std::byte> held_;
  Frame frame_ = {};
  std::int32_t place_ = 0;  // in the order of a frame of version 3
};

// Messages of a viewer, appended to `out`.
void append_head(std::vector<std::byte>& out, Type type, std::int32_t value);
/// Forces on atoms: x, y, z of each in turn. `swapped`: as the engine wants it.
void append_forces(std::vector<std::byte>& out, std::span<const std::int32_t> atoms,
                   std::span<const float> forces, bool swapped);

}  // namespace tandem::imd
