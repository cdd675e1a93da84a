#pragma once
// Mistakes in a scene's text that clients would pass over: they draw what they understand.

#include <string>

#include "sdk/wire/text_message.hpp"

namespace tandem::host {

/// What is wrong with a scene of idl/scene.proto: a field that it does not have, a value that is no number, a
/// plane without a normal. Empty: nothing. Of what clients do not read only the names are checked.
[[nodiscard]] std::string wrong_with_scene(const transport::TextMessage& scene);

}  // namespace tandem::host
