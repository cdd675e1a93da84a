#pragma once
// A scene as the JSON that sessions announce. Internal to scenes.

#include <scene.pb.h>

#include <string>

#include "tandem/result.hpp"

namespace tandem::scenes {

/// `scene` in protobuf's JSON mapping, as its printer writes it by default; without numbers that are not
/// finite, for which JSON has no form. Empty if it cannot be printed.
[[nodiscard]] std::string to_json(idl::Scene scene);

/// Reads untrusted bytes; members that idl/scene.proto does not have are ignored. Errors: kMalformed.
[[nodiscard]] Result<idl::Scene> read_json(const std::string& json, const std::string& source);

}  // namespace tandem::scenes
