#pragma once
// A sample with its own memory.

#include <vector>

#include "sdk/client/drawing/sampler.hpp"

namespace tandem::client {

struct Taken : SampledFrame {
  std::vector<float> positions, velocities, orientations, angular_velocities;
  std::vector<std::uint16_t> types;
  std::vector<std::uint8_t> alive, reuse;
  std::vector<BodyChange> changes;

  SampleColumns make_room(std::size_t slots) {
    positions.resize(3 * slots);
    velocities.resize(3 * slots);
    orientations.resize(4 * slots);
    angular_velocities.resize(3 * slots);
    types.resize(slots);
    alive.resize(slots);
    reuse.resize(slots);
    changes.resize(slots);
    SampleColumns columns{.capacity = slots};
    columns.positions = packed(positions.data(), 3);
    columns.velocities = packed(velocities.data(), 3);
    columns.orientations = packed(orientations.data(), 4);
    columns.angular_velocities = packed(angular_velocities.data(), 3);
    columns.types = packed(types.data());
    columns.alive = packed(alive.data());
    columns.reuse = packed(reuse.data());
    columns.changes = packed(reinterpret_cast<std::uint8_t*>(changes.data()));
    return columns;
  }
  [[nodiscard]] bool take(Sampler& sampler, const Picture& picture, const SampleRequest& request,
                          std::int64_t now_ns) {
    const auto taken = sampler.sample(picture, request, make_room(picture.agreed->alive.size()), now_ns);
    if (taken) static_cast<SampledFrame&>(*this) = *taken;
    return taken.has_value();
  }
};

}  // namespace tandem::client
