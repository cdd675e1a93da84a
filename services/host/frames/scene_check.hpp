#pragma once
// Mistakes in a scene's JSON that clients would pass over: they draw what they understand.

#include <string>
#include <string_view>

namespace tandem::host {

/// Says what is wrong with a Scene of idl/scene.proto in protobuf's JSON mapping: text that is not JSON, an
/// unknown member, a value that is not a finite number, a plane without a normal. Empty: nothing is wrong.
/// Of the members that clients do not read, only the names are checked. The empty text means no scene.
[[nodiscard]] std::string wrong_with_scene(std::string_view json);

}  // namespace tandem::host
