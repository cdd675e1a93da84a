// tandem.h: what a session is made of.
#include <algorithm>
#include <string>

#include "sdk/client/api/clients.hpp"
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
