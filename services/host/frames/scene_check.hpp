#pragma once
// Mistakes in a scene's JSON that clients would pass over: they draw what they understand.

#include <string>
#include <string_view>

namespace tandem::host {

/// What is wrong with a message Scene of idl/scene.proto in protobuf's JSON mapping: no JSON, a member that
/// it does not have, a value that is no finite number, a plane without a normal. Empty: nothing. Of what
/// clients do not read only the names are checked. The empty text is no scene.
[[nodiscard]] std::string wrong_with_scene(std::string_view json);

}  // namespace tandem::host
