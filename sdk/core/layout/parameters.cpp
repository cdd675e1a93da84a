#include "sdk/core/layout/parameters.hpp"

#include <string>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

struct Range {
  std::int32_t least, most;
};

Range range_of(ParameterId id) {
  switch (id) {
    case ParameterId::kThreshold:
      return {1, kPositionLimit};
    case ParameterId::kPositionStep:
    case ParameterId::kVelocityStep:
    case ParameterId::kTurnStep:
    case ParameterId::kSpinStep:
      return {1, kMaxStep};
    case ParameterId::kContactRadius:
      return {-ContactParameters::kMaxLonger, ContactParameters::kMaxLonger};
    case ParameterId::kWallDistance:
      return {-kMaxStep, kMaxStep};
    case ParameterId::kFriction:
      return {0, ContactParameters::kMaxFriction};
    case ParameterId::kRounding:
      return {0, ContactParameters::kMaxRounding};
    case ParameterId::kDecay:
    case ParameterId::kVelocityGain:
    case ParameterId::kAccelerationGain:
      break;
  }
  return {0, UINT16_MAX};
}

bool known(std::uint32_t id) { return id >= 1 && id <= kParameterCount; }

}  // namespace

std::int32_t parameter(const StreamParameters& values, ParameterId id) {
  switch (id) {
    case ParameterId::kThreshold:
      return values.codec.threshold;
    case ParameterId::kPositionStep:
      return values.codec.position_step;
    case ParameterId::kVelocityStep:
      return values.codec.velocity_step;
    case ParameterId::kDecay:
      return values.step.decay;
    case ParameterId::kVelocityGain:
      return values.codec.velocity_gain;
    case ParameterId::kAccelerationGain:
      return values.codec.acceleration_gain;
    case ParameterId::kTurnStep:
      return values.codec.turn_step;
    case ParameterId::kSpinStep:
      return values.codec.spin_step;
    case ParameterId::kContactRadius:
      return values.step.contacts.radius;
    case ParameterId::kWallDistance:
      return values.step.contacts.wall;
    case ParameterId::kFriction:
      return values.step.contacts.friction;
    case ParameterId::kRounding:
      break;
  }
  return values.step.contacts.rounding;
}

Result<void> set_parameter(StreamParameters& values, std::uint32_t id, std::int32_t value) {
  if (!known(id)) return fail(ErrorCode::kUnsupported, "unknown parameter " + std::to_string(id));
  const auto which = static_cast<ParameterId>(id);
  const Range range = range_of(which);
  if (value < range.least || value > range.most) {
    return fail(ErrorCode::kMalformed,
                "parameter " + std::to_string(id) + " out of range: " + std::to_string(value));
  }
  switch (which) {
    case ParameterId::kThreshold:
      values.codec.threshold = value;
      break;
    case ParameterId::kPositionStep:
      values.codec.position_step = value;
      break;
    case ParameterId::kVelocityStep:
      values.codec.velocity_step = value;
      break;
    case ParameterId::kDecay:
      values.step.decay = static_cast<std::uint16_t>(value);
      break;
    case ParameterId::kVelocityGain:
      values.codec.velocity_gain = static_cast<std::uint16_t>(value);
      break;
    case ParameterId::kAccelerationGain:
      values.codec.acceleration_gain = static_cast<std::uint16_t>(value);
      break;
    case ParameterId::kTurnStep:
      values.codec.turn_step = value;
      break;
    case ParameterId::kSpinStep:
      values.codec.spin_step = value;
      break;
    case ParameterId::kContactRadius:
      values.step.contacts.listed = true;
      values.step.contacts.radius = value;
      break;
    case ParameterId::kWallDistance:
      values.step.contacts.listed = true;
      values.step.contacts.wall = value;
      break;
    case ParameterId::kFriction:
      values.step.contacts.listed = true;
      values.step.contacts.friction = value;
      break;
    case ParameterId::kRounding:
      values.step.contacts.listed = true;
      values.step.contacts.rounding = value;
      break;
  }
  return {};
}

std::vector<Parameter> list_parameters(const StreamParameters& values) {
  std::vector<Parameter> list;
  for (std::uint32_t id = 1; id <= kParameterCount; ++id) {
    if (!lists(values, id)) continue;
    list.push_back({id, parameter(values, static_cast<ParameterId>(id))});
  }
  TANDEM_ASSERT(list.size() == parameter_count(values));
  return list;
}

Result<StreamParameters> parameters_from(std::span<const Parameter> list) {
  StreamParameters values;
  std::uint32_t previous = 0;
  for (const Parameter& each : list) {
    if (each.id <= previous) return fail(ErrorCode::kMalformed, "parameters out of order or repeated");
    previous = each.id;
    if (auto set = set_parameter(values, each.id, each.value); !set)
      return tl::unexpected<Error>(set.error());
  }
  if (list.size() != parameter_count(values)) return fail(ErrorCode::kMalformed, "parameters missing");
  return values;
}

void write_parameters(const StreamParameters& values, const StreamParameters* in_force, ByteWriter& out) {
  TANDEM_ASSERT(in_force == nullptr || list_the_same(values, *in_force));
  for (std::uint32_t id = 1; id <= kParameterCount; ++id) {
    if (!lists(values, id)) continue;
    const std::int32_t value = parameter(values, static_cast<ParameterId>(id));
    if (in_force != nullptr && parameter(*in_force, static_cast<ParameterId>(id)) == value) continue;
    out.put(static_cast<std::uint8_t>(id));
    out.put_leb128(zigzag(value));
  }
}

Result<std::uint32_t> read_parameters(std::span<const std::byte> section, StreamParameters& values) {
  ByteReader in(section);
  std::uint32_t previous = 0;
  std::uint32_t count = 0;
  StreamParameters read = values;
  while (in.ok() && in.remaining() > 0) {
    const std::uint32_t id = in.get<std::uint8_t>();
    const std::uint64_t value = in.get_leb128(kMaxParameterValueBytes);
    if (!in.ok() || value > UINT32_MAX) {
      return fail(ErrorCode::kMalformed, "parameter that is truncated or not in shortest form");
    }
    if (id <= previous) return fail(ErrorCode::kMalformed, "parameters out of order or repeated");
    previous = id;
    if (auto set = set_parameter(read, id, from_zigzag(static_cast<std::uint32_t>(value))); !set)
      return tl::unexpected<Error>(set.error());
    ++count;
  }
  values = read;
  return count;
}

}  // namespace tandem
