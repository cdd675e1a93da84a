#pragma once
// Ownership of what Cyclone DDS hands out: entities, QoS, endpoints, texts.

#include <dds/dds.h>

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "tandem/result.hpp"

namespace tandem::transport::dds {

/// Owns an entity and deletes it with all its children.
class Entity {
 public:
  Entity() = default;
  explicit Entity(dds_entity_t handle) : handle_(handle) {}
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    if (this != &other) {
      reset();
      handle_ = std::exchange(other.handle_, 0);
    }
    return *this;
  }
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;
  ~Entity() { reset(); }

  [[nodiscard]] dds_entity_t get() const { return handle_; }
  [[nodiscard]] explicit operator bool() const { return handle_ > 0; }
  void reset() {
    if (handle_ > 0) dds_delete(handle_);
    handle_ = 0;
  }

 private:
  dds_entity_t handle_ = 0;
};

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, QosDeleter>;

/// An error such as "creating the delta writer: Bad Parameter".
[[nodiscard]] inline tl::unexpected<Error> dds_failure(const std::string& doing, dds_return_t code) {
  return fail(code == DDS_RETCODE_TIMEOUT ? ErrorCode::kTimeout : ErrorCode::kTransport,
              doing + ": " + dds_strretcode(code));
}

/// Takes ownership of the result of a dds_create_... function.
[[nodiscard]] inline Result<Entity> own(dds_entity_t created, const std::string& doing) {
  if (created < 0) return dds_failure("creating " + doing, created);
  return Entity(created);
}

struct EndpointDeleter {
  void operator()(dds_builtintopic_endpoint_t* endpoint) const { dds_builtintopic_free_endpoint(endpoint); }
};
/// What discovery tells of a reader or writer.
using Endpoint = std::unique_ptr<dds_builtintopic_endpoint_t, EndpointDeleter>;

/// Maximum length of what a stranger says of itself; the rest is cut off.
inline constexpr std::size_t kMaxTextBytes = 256;

/// Copies such a text and frees it with dds_free(); null is empty.
inline std::string take_text(char* text) {
  if (text == nullptr) return {};
  std::string taken = std::string(text).substr(0, kMaxTextBytes);
  dds_free(text);
  return taken;
}
/// The name of an entity, and one of its properties; empty if it has none.
inline std::string name_of(const dds_qos_t* qos) {
  char* name = nullptr;
  return dds_qget_entity_name(qos, &name) ? take_text(name) : std::string();
}
inline std::string property_of(const dds_qos_t* qos, const char* property) {
  char* value = nullptr;
  return dds_qget_prop(qos, property, &value) ? take_text(value) : std::string();
}

}  // namespace tandem::transport::dds
