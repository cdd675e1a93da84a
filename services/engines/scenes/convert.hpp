#pragma once
// Converts generated messages to plain values. Internal to scenes.

#include <scene.pb.h>
#include <cmath>

#include "services/engines/bullet/inputs.hpp"
#include "services/engines/common/shape.hpp"
#include "tandem/simulation.hpp"

namespace tandem::scenes {

inline engine::Vec3 to_vec3(const idl::Vec3& v) { return {v.x(), v.y(), v.z()}; }

inline engine::Vec3f to_float(const engine::Vec3& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}
inline engine::Vec3f to_float(const idl::Vec3& v) { return to_float(to_vec3(v)); }

/// Converts a shape without checking it.
inline engine::Shape to_shape(const idl::BodyType& type) {
  using Kind = engine::Shape::Kind;
  const auto half = [](double length) { return static_cast<float>(length / 2); };
  const auto rod = [&half](Kind kind, const idl::Rod& r) {
    return engine::Shape{kind, 0, {static_cast<float>(r.radius_m()), half(r.length_m())}};
  };
  switch (type.shape_case()) {
    case idl::BodyType::kBox:
      return {Kind::kBox, 0, {half(type.box().x()), half(type.box().y()), half(type.box().z())}};
    case idl::BodyType::kCapsule:
      return rod(Kind::kCapsule, type.capsule());
    case idl::BodyType::kCylinder:
      return rod(Kind::kCylinder, type.cylinder());
    case idl::BodyType::kHull: {
      engine::Shape hull{Kind::kHull, 0, {}};
      for (const idl::Vec3& point : type.hull().points()) {
        for (const float v : to_float(point)) hull.values.push_back(v);
      }
      return hull;
    }
    case idl::BodyType::SHAPE_NOT_SET:
      break;
  }
  return {Kind::kSphere, static_cast<float>(type.radius_m()), {}};
}

/// A checked event's input.
inline engine::Input to_input(const idl::InputEvent& event) {
  if (event.input_case() == idl::InputEvent::kSpawn) {
    const idl::Spawn& spawn = event.spawn();
    return engine::to_input(engine::Spawn{.type = static_cast<std::uint16_t>(spawn.type()),
                                          .position = to_float(spawn.position()),
                                          .velocity = to_float(spawn.velocity()),
                                          .angular_velocity = to_float(spawn.angular_velocity())});
  }
  if (event.input_case() == idl::InputEvent::kRemove) {
    return engine::to_input(engine::Remove{.centre = to_float(event.remove().centre()),
                                           .radius = static_cast<float>(event.remove().radius_m())});
  }
  engine::Input input;
  if (event.input_case() == idl::InputEvent::kSeekS) {
    input.kind = static_cast<std::uint32_t>(engine::InputKind::kSeek);
    input.values.push_back(event.seek_s());
  } else if (event.input_case() == idl::InputEvent::kGravity) {
    input.kind = static_cast<std::uint32_t>(engine::InputKind::kGravity);
    for (const double v : to_vec3(event.gravity())) input.values.push_back(v);
  } else {
    input.kind = static_cast<std::uint32_t>(engine::InputKind::kPush);
    for (const double v : to_vec3(event.push().centre())) input.values.push_back(v);
    input.values.push_back(event.push().radius_m());
    for (const double v : to_vec3(event.push().velocity_change())) input.values.push_back(v);
  }
  return input;
}

/// A checked event's frame: 1 is the first.
inline std::uint64_t to_frame(const idl::InputEvent& event, double dt_s) {
  if (event.when_case() == idl::InputEvent::kFrame) return event.frame();
  return std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(event.time_s() / dt_s)));
}

}  // namespace tandem::scenes
