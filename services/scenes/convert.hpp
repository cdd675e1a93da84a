#pragma once
// From generated messages to plain values. Internal to scenes.

#include <scene.pb.h>
#include <cmath>

#include "services/host/simulation.hpp"

namespace tandem::scenes {

inline engine::Vec3 to_vec3(const idl::Vec3& v) { return {v.x(), v.y(), v.z()}; }

/// A checked event's input.
inline engine::Input to_input(const idl::InputEvent& event) {
  engine::Input input;
  if (event.input_case() == idl::InputEvent::kGravity) {
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
