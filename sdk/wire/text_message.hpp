#pragma once
// Reads protobuf text as far as a scene's description needs it: without a schema, and without a library that
// a browser would have to load.

#include <cstddef>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::transport {

/// One value of a field: a message or a scalar. Points into the text.
struct TextField {
  std::string_view name;
  std::string_view scalar;  ///< as written, escapes not resolved; for adjacent strings the first
  bool is_message = false;
  std::vector<TextField> message = {};
};
using TextMessage = std::vector<TextField>;

/// Reads a text from the network: its size, depth and number of fields are bounded. Errors: kMalformed,
/// naming the line.
[[nodiscard]] Result<TextMessage> read_text_message(std::string_view text);

/// The last of several values counts, as in protobuf. The result is null or empty if there is no value of
/// that kind; `message` may be null.
[[nodiscard]] const TextMessage* child(const TextMessage* message, std::string_view name);
[[nodiscard]] std::string_view scalar(const TextMessage* message, std::string_view name);

}  // namespace tandem::transport
