#pragma once
// Numbers from text.

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace tandem::planning {

/// The number that `text` consists of; empty if it is none.
template <class T>
[[nodiscard]] std::optional<T> number(std::string_view text) {
  T value{};
  const char* const end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, value);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  return value;
}

}  // namespace tandem::planning
