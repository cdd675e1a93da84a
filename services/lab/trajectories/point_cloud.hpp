#pragma once
// Bodies as a message that viewers of point clouds know: foxglove.PointCloud in JSON.

#include <cstdint>
#include <span>
#include <string>

#include "sdk/wire/messages.hpp"
#include "services/follow/recording/mcap_writer.hpp"
#include "tandem/simulation.hpp"

namespace tandem::lab {

/// The channel of such messages in an MCAP file.
[[nodiscard]] recording::McapWriter::Kind point_cloud_kind(const std::string& topic);

/// A point cloud of the bodies alive, ascending by slot: x, y, z, radius (float32, scene units), red, green,
/// blue, alpha (uint8), type (uint32). A type that is not listed has radius 0 and is white. `time_ns`: wall
/// clock.
[[nodiscard]] std::string point_cloud(const engine::Bodies& bodies,
                                      std::span<const transport::BodyType> types, std::uint64_t time_ns);

}  // namespace tandem::lab
