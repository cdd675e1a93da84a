#pragma once
// Protobuf text, as far as a scene's description needs it: no schema, and no library that a browser would
// load.

#include <cstddef>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::transport {

/// One value of a field: a message, or what stands in the text. Points into the text.
struct TextField {
  std::string_view name;
  std::string_view scalar;  ///< as written; of strings side by side the first, without escapes resolved
  bool is_message = false;
  std::vector<TextField> message = {};
};
using TextMessage = std::vector<TextField>;

/// The text comes from the network: its size, depth and number of fields are bounded. Errors: kMalformed,
/// naming the line.
[[nodiscard]] Result<TextMessage> read_text_message(std::string_view text);

/// As protobuf, the last of several values counts. Null, and empty, where there is none of that kind;
/// `message` may be null.
[[nodiscard]] const TextMessage* child(const TextMessage* message, std::string_view name);
[[nodiscard]] std::string_view scalar(const TextMessage* message, std::string_view name);

}  // namespace tandem::transport
