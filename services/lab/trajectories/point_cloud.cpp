#include "services/lab/trajectories/point_cloud.hpp"

#include <openssl/evp.h>

#include <array>
#include <bit>
#include <cstddef>
#include <string_view>
#include <vector>

#include "sdk/wire/units.hpp"
#include "services/program/json/json.hpp"

namespace tandem::lab {
namespace {

static_assert(std::endian::native == std::endian::little, "points are written as they lie in memory");

// https://docs.foxglove.dev/docs/visualization/message-schemas/point-cloud, without the descriptions.
constexpr std::string_view kSchema =
    R"({"title":"foxglove.PointCloud","type":"object","properties":{
"timestamp":{"type":"object","title":"time","properties":{"sec":{"type":"integer","minimum":0},"nsec":{"type":"integer","minimum":0,"maximum":999999999}}},
"frame_id":{"type":"string"},
"pose":{"title":"foxglove.Pose","type":"object","properties":{
"position":{"title":"foxglove.Vector3","type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},
"orientation":{"title":"foxglove.Quaternion","type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}},
"point_stride":{"type":"integer","minimum":0},
"fields":{"type":"array","items":{"title":"foxglove.PackedElementField","type":"object","properties":{"name":{"type":"string"},"offset":{"type":"integer","minimum":0},"type":{"title":"foxglove.NumericType","oneOf":[{"title":"UNKNOWN","const":0},{"title":"UINT8","const":1},{"title":"INT8","const":2},{"title":"UINT16","const":3},{"title":"INT16","const":4},{"title":"UINT32","const":5},{"title":"INT32","const":6},{"title":"FLOAT32","const":7},{"title":"FLOAT64","const":8}]}}}},
"data":{"type":"string","contentEncoding":"base64"}}})";

enum NumericType : int { kUint8 = 1, kUint32 = 5, kFloat32 = 7 };

struct Point {
  float x = 0, y = 0, z = 0, radius = 0;
  std::array<std::uint8_t, 4> colour{};  // red, green, blue, alpha
  std::uint32_t type = 0;
};
static_assert(sizeof(Point) == 24);

Point point_of(const engine::Bodies& bodies, std::size_t slot, std::span<const transport::BodyType> types) {
  const TypeId type = bodies.type[slot];
  const transport::BodyType known =
      type < types.size() ? transport::BodyType{.name = {},
                                                .radius = types[type].radius,
                                                .colour_rgba = types[type].colour_rgba}
                          : transport::BodyType{.name = {}, .radius = 0, .colour_rgba = 0xFFFFFFFF};
  const auto byte = [&](unsigned shift) { return static_cast<std::uint8_t>(known.colour_rgba >> shift); };
  return {.x = bodies.position[0][slot],
          .y = bodies.position[1][slot],
          .z = bodies.position[2][slot],
          .radius = known.radius,
          .colour = {byte(24), byte(16), byte(8), byte(0)},
          .type = type};
}

std::string base64(std::span<const Point> points) {
  std::string out((points.size_bytes() + 2) / 3 * 4 + 1, '\0');  // OpenSSL writes an end, too
  EVP_EncodeBlock(reinterpret_cast<unsigned char*>(out.data()),
                  reinterpret_cast<const unsigned char*>(points.data()),
                  static_cast<int>(points.size_bytes()));
  out.pop_back();
  return out;
}

}  // namespace

recording::McapWriter::Kind point_cloud_kind(const std::string& topic) {
  return {.topic = topic,
          .message_encoding = "json",
          .schema_name = "foxglove.PointCloud",
          .schema_encoding = "jsonschema",
          .schema = kSchema};
}

std::string point_cloud(const engine::Bodies& bodies, std::span<const transport::BodyType> types,
                        std::uint64_t time_ns) {
  std::vector<Point> points;
  for (std::size_t slot = 0; slot < bodies.alive.size(); ++slot) {
    if (bodies.alive[slot] != 0) points.push_back(point_of(bodies, slot, types));
  }
  const auto field = [](const char* name, std::size_t offset, NumericType type) {
    return Json{{"name", name}, {"offset", offset}, {"type", static_cast<int>(type)}};
  };
  constexpr std::uint64_t kNsPerS = kSecond;
  Json cloud;
  cloud["timestamp"] = {{"sec", time_ns / kNsPerS}, {"nsec", time_ns % kNsPerS}};
  cloud["frame_id"] = "world";
  cloud["pose"]["position"] = {{"x", 0}, {"y", 0}, {"z", 0}};
  cloud["pose"]["orientation"] = {{"x", 0}, {"y", 0}, {"z", 0}, {"w", 1}};
  cloud["point_stride"] = sizeof(Point);
  cloud["fields"] = Json::array(
      {field("x", offsetof(Point, x), kFloat32), field("y", offsetof(Point, y), kFloat32),
       field("z", offsetof(Point, z), kFloat32), field("radius", offsetof(Point, radius), kFloat32),
       field("red", offsetof(Point, colour), kUint8), field("green", offsetof(Point, colour) + 1, kUint8),
       field("blue", offsetof(Point, colour) + 2, kUint8),
       field("alpha", offsetof(Point, colour) + 3, kUint8), field("type", offsetof(Point, type), kUint32)});
  cloud["data"] = base64(points);
  return cloud.dump();
}

}  // namespace tandem::lab
