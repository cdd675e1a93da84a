// Implements "What a session is made of" of tandem.h.
#include <algorithm>
#include <cstddef>
#include <iterator>
#include <memory>
#include <string>

#include "sdk/client/api/clients.hpp"
#include "sdk/client/api/drawn_scene.hpp"
#include "sdk/client/api/structs.hpp"

namespace tandem::api {
namespace {

constexpr bool same(int theirs, BodyShape ours) { return theirs == static_cast<int>(ours); }
static_assert(same(TANDEM_SHAPE_NONE, BodyShape::kNone) && same(TANDEM_SHAPE_SPHERE, BodyShape::kSphere) &&
              same(TANDEM_SHAPE_BOX, BodyShape::kBox) && same(TANDEM_SHAPE_CAPSULE, BodyShape::kCapsule) &&
              same(TANDEM_SHAPE_CYLINDER, BodyShape::kCylinder) && same(TANDEM_SHAPE_HULL, BodyShape::kHull));

tandem_result no_session() { return refuse(TANDEM_NOT_READY, "no session is known yet"); }

/// Calls `use(type)` while the client is locked; `use` returns a tandem_result.
template <class Use>
tandem_result with_type(tandem_client client, std::uint32_t index, Use&& use) {
  return with_client(client, [&](RunningClient& running) {
    return running.with_session([&](const transport::SessionMessage* session) {
      if (session == nullptr) return no_session();
      if (index >= session->types.size()) {
        return refuse(TANDEM_INVALID_ARGUMENT, "the session has fewer types of bodies");
      }
      return use(session->types[index]);
    });
  });
}

void copy(const Vector& from, float (&to)[3]) {  // NOLINT(*-avoid-c-arrays): C's
  for (std::size_t i = 0; i < from.size(); ++i) to[i] = static_cast<float>(from[i]);
}

tandem_solid to_c(const Solid& solid) {
  tandem_solid out = TANDEM_SOLID_INIT;
  switch (solid.shape) {
    case Solid::Shape::kPlane:
      out.shape = TANDEM_SHAPE_PLANE;
      break;
    case Solid::Shape::kBox:
      out.shape = TANDEM_SHAPE_BOX;
      break;
    case Solid::Shape::kSphere:
      out.shape = TANDEM_SHAPE_SPHERE;
      break;
  }
  copy(solid.centre, out.centre);
  copy(solid.normal, out.normal);
  copy({solid.size[0] / 2, solid.size[1] / 2, solid.size[2] / 2}, out.half_size);
  for (std::size_t i = 0; i < solid.orientation.size(); ++i) {
    out.orientation[i] = static_cast<float>(solid.orientation[i]);
  }
  out.radius = static_cast<float>(solid.radius);
  return out;
}

/// The scene of the known session. It is read again if that is another run of a server.
Result<std::shared_ptr<const KnownScene>> scene_of(RunningClient& client) {
  auto held = client.scene();
  Epoch epoch = 0;
  std::string text;
  const bool known = client.with_session([&](const transport::SessionMessage* session) {
    if (session == nullptr) return false;
    epoch = session->epoch;
    if (held == nullptr || held->epoch != epoch) text = session->scene_json;
    return true;
  });
  if (!known) return fail(ErrorCode::kNotReady, "no session is known yet");
  if (held == nullptr || held->epoch != epoch) {
    held = std::make_shared<const KnownScene>(KnownScene{epoch, read_scene_json(text)});
    client.hold_scene(held);
  }
  if (!held->scene) return tl::unexpected<Error>(held->scene.error());
  return held;
}

}  // namespace
}  // namespace tandem::api

using namespace tandem;  // what follows is C
using namespace tandem::api;

tandem_result tandem_get_type(tandem_client client, uint32_t index, tandem_body_type* type) noexcept {
  return with_type(client, index, [&](const transport::BodyType& known) {
    if (const auto checked = check_struct(type); checked != TANDEM_OK) return checked;
    tandem_body_type out = TANDEM_BODY_TYPE_INIT;
    out.shape = static_cast<tandem_shape>(known.shape);
    out.radius = known.radius;
    out.colour_rgba = known.colour_rgba;
    out.value_count = static_cast<std::uint32_t>(known.shape_values.size());
    std::copy_n(known.shape_values.begin(), std::min(known.shape_values.size(), std::size(out.values)),
                std::begin(out.values));
    write_text(known.name, out.name);
    write_struct(out, type);
    return kOk;
  });
}

tandem_result tandem_get_type_values(tandem_client client, uint32_t index, float* values, size_t capacity,
                                     size_t* count) noexcept {
  return with_type(client, index, [&](const transport::BodyType& known) {
    if (values == nullptr && capacity != 0) return null_pointer("`values` is null");
    const std::size_t all = known.shape_values.size();
    std::copy_n(known.shape_values.begin(), std::min(all, capacity), values);
    if (count != nullptr) *count = all;
    if (capacity != 0 && capacity < all) return refuse(TANDEM_CAPACITY, "the shape has more values");
    return kOk;
  });
}

tandem_result tandem_get_scene(tandem_client client, tandem_scene* scene) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (const auto checked = check_struct(scene); checked != kOk) return checked;
    const auto known = scene_of(running);
    if (!known) return refuse(known.error());
    const DrawnScene& text = *(*known)->scene;
    tandem_scene out = TANDEM_SCENE_INIT;
    const bool still = running.with_session([&](const transport::SessionMessage* session) {
      if (session == nullptr) return false;
      out.capacity = session->capacity;
      out.type_count = static_cast<std::uint32_t>(session->types.size());
      out.frame_rate_hz = session->frame_rate_hz;
      out.dt_s = session->dt_s;
      std::copy(session->gravity.begin(), session->gravity.end(), std::begin(out.gravity));
      out.up_axis = static_cast<std::uint32_t>(session->up_axis);
      out.continues_epoch = session->continues_epoch;
      out.continues_frame = session->continues_frame;
      write_text(session->scene, out.name);
      return true;
    });
    if (!still) return no_session();
    out.solid_count = static_cast<std::uint32_t>(text.solids.size());
    out.max_gravity = text.max_gravity;
    out.max_push = text.max_push;
    copy(text.low, out.low);
    copy(text.high, out.high);
    write_struct(out, scene);
    return kOk;
  });
}

tandem_result tandem_get_body_name(tandem_client client, uint32_t slot, char* name, size_t size) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (name == nullptr || size == 0) return null_pointer("`name` has no room");
    return running.with_core([&](const client::ClientCore& core) {
      if (core.session() == nullptr) return no_session();
      if (slot >= core.session()->capacity)
        return refuse(TANDEM_INVALID_ARGUMENT, "the session has fewer slots");
      if (core.timeline() == nullptr) return refuse(TANDEM_NOT_READY, "the client does not play");
      write_text(core.body_name(slot), name, size);
      return kOk;
    });
  });
}

tandem_result tandem_get_geometry(tandem_client client, tandem_solid* solids, size_t capacity,
                                  size_t* count) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (capacity != 0) {
      if (const auto checked = check_struct(solids); checked != kOk) return checked;
    }
    const auto known = scene_of(running);
    if (!known) return refuse(known.error());
    const std::vector<Solid>& all = (*known)->scene->solids;
    const std::size_t size = capacity != 0 ? size_of(solids) : 0;
    auto* const first = reinterpret_cast<std::byte*>(solids);
    for (std::size_t i = 0; i < std::min(capacity, all.size()); ++i) {
      write_struct(to_c(all[i]), first + i * size, size);
    }
    if (count != nullptr) *count = all.size();
    if (capacity != 0 && capacity < all.size()) return refuse(TANDEM_CAPACITY, "the scene has more solids");
    return kOk;
  });
}
