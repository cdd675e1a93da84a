#pragma once
// The parameters that may change between frames; a delta that changes one says so. There are two types,
// because decoder and predicted step begin to use a change at different frames.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/state.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// What the decoder uses besides its bytes: a change in delta f is in force from delta f on.
struct CodecParameters {
  std::int32_t threshold = 0;      ///< lattice units; bodies with a larger error are corrected. 1 .. 2^30
  std::int32_t position_step = 1;  ///< lattice units per quantisation step (range / 127). 1 .. 2^24
  std::int32_t velocity_step = 1;  ///< 1/64 unit per frame per quantisation step (range / 127). 1 .. 2^24
  // For codecs that steer a filter (`tracker`); the others ignore them. Any value is valid.
  std::uint16_t velocity_gain = 26214;     ///< beta, in 1/32768: share of a correction that counts as an
                                           ///< error of v
  std::uint16_t acceleration_gain = 9830;  ///< gamma, in 1/65536: share of that error that counts as an error
                                           ///< of c
  // Listed if codec and groups of the stream need both; 0 otherwise.
  std::int32_t turn_step = 0;  ///< 2^-28 rad per quantisation step of a rotation vector. 1 .. 2^24
  std::int32_t spin_step = 0;  ///< 2^-28 rad per frame per step of an angular velocity. 1 .. 2^24
  friend bool operator==(const CodecParameters&, const CodecParameters&) = default;
};
/// What a predictor of hard contacts uses; learned at run time.
struct ContactParameters {
  bool listed = false;        ///< never changes within a stream; otherwise all are 0
  std::int32_t radius = 0;    ///< what radii are longer than their types', in 1/65536. +-kMaxLonger
  std::int32_t wall = 0;      ///< what radii are longer still towards the static geometry, lattice units.
                              ///< +-kMaxStep
  std::int32_t friction = 0;  ///< in 1/4096. 0 .. kMaxFriction
  std::int32_t rounding = 0;  ///< how round edges of boxes are, by their smallest half size, in 1/65536. 0 ..
                              ///< kMaxRounding
  static constexpr std::int32_t kMaxLonger = 16384, kMaxFriction = 4096, kMaxRounding = 16384;
  friend bool operator==(const ContactParameters&, const ContactParameters&) = default;
};
/// What the predicted step uses besides state and drive: a change in delta f is in force from the step that
/// produces f + 1 on, because the step that produced f came before the delta. Any value is valid.
struct StepParameters {
  std::uint16_t decay = 0;  ///< E: share of c lost per frame, in 1/65536
  ContactParameters contacts = {};
  friend bool operator==(const StepParameters&, const StepParameters&) = default;
};

/// All parameters of a stream that a delta may change.
struct StreamParameters {
  CodecParameters codec = {};
  StepParameters step = {};
  friend bool operator==(const StreamParameters&, const StreamParameters&) = default;
};

/// 127 steps of this size span the lattice from end to end.
inline constexpr std::int32_t kMaxStep = 1 << 24;

/// True if the steps of turns are listed. Never changes within a stream.
[[nodiscard]] constexpr bool has_turn_steps(const CodecParameters& parameters) {
  return parameters.turn_step != 0 || parameters.spin_step != 0;
}

/// True if all listed parameters are in their ranges.
[[nodiscard]] constexpr bool valid_parameters(const CodecParameters& parameters) {
  const auto in = [](std::int32_t value, std::int32_t most) { return value >= 1 && value <= most; };
  return in(parameters.threshold, kPositionLimit) && in(parameters.position_step, kMaxStep) &&
         in(parameters.velocity_step, kMaxStep) &&
         (!has_turn_steps(parameters) ||
          (in(parameters.turn_step, kMaxStep) && in(parameters.spin_step, kMaxStep)));
}

/// The ids of parameters in sessions, deltas and snapshots: idl/PROTOCOL.md, "Parameters".
enum class ParameterId : std::uint8_t {
  kThreshold = 1,
  kPositionStep = 2,
  kVelocityStep = 3,
  kDecay = 4,
  kVelocityGain = 5,
  kAccelerationGain = 6,
  kTurnStep = 7,
  kSpinStep = 8,
  kContactRadius = 9,
  kWallDistance = 10,
  kFriction = 11,
  kRounding = 12,
};
inline constexpr std::uint32_t kParameterCount = 12;
/// True if a stream with these values lists the parameter `id`, 1 .. kParameterCount.
[[nodiscard]] constexpr bool lists(const StreamParameters& values, std::uint32_t id) {
  if (id <= static_cast<std::uint32_t>(ParameterId::kAccelerationGain)) return true;
  return id <= static_cast<std::uint32_t>(ParameterId::kSpinStep) ? has_turn_steps(values.codec)
                                                                  : values.step.contacts.listed;
}
/// True if streams with these values list the same parameters.
[[nodiscard]] constexpr bool list_the_same(const StreamParameters& a, const StreamParameters& b) {
  return has_turn_steps(a.codec) == has_turn_steps(b.codec) &&
         a.step.contacts.listed == b.step.contacts.listed;
}
/// Number of parameters that a stream lists.
[[nodiscard]] constexpr std::uint32_t parameter_count(const StreamParameters& values) {
  return 6U + (has_turn_steps(values.codec) ? 2U : 0U) + (values.step.contacts.listed ? 4U : 0U);
}
inline constexpr std::size_t kMaxParameterValueBytes = 5;
/// Maximum number of bytes that write_parameters() writes.
inline constexpr std::size_t kMaxParametersBytes = kParameterCount * (1 + kMaxParameterValueBytes);

[[nodiscard]] std::int32_t parameter(const StreamParameters& values, ParameterId id);
/// Sets one parameter. Errors: kUnsupported (unknown id), kMalformed (out of range); then nothing changed.
[[nodiscard]] Result<void> set_parameter(StreamParameters& values, std::uint32_t id, std::int32_t value);

struct Parameter {
  std::uint32_t id = 0;
  std::int32_t value = 0;
  friend bool operator==(const Parameter&, const Parameter&) = default;
};
/// All parameters of the stream, ascending by id, as a session lists them.
[[nodiscard]] std::vector<Parameter> list_parameters(const StreamParameters& values);
/// Reads such a list. Untrusted. Errors: kMalformed (out of order, repeated, missing, out of range),
/// kUnsupported (unknown id).
[[nodiscard]] Result<StreamParameters> parameters_from(std::span<const Parameter> list);

/// Writes the parameters of `values` that differ from `in_force`; all of them if that is null.
void write_parameters(const StreamParameters& values, const StreamParameters* in_force, ByteWriter& out);
/// Reads untrusted bytes into `values`, only the named parameters. Returns their number; the caller checks
/// whether the stream lists them. Errors: kMalformed, kUnsupported (unknown id); then `values` is as before.
[[nodiscard]] Result<std::uint32_t> read_parameters(std::span<const std::byte> section,
                                                    StreamParameters& values);

}  // namespace tandem
