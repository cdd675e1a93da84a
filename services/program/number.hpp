#pragma once
// Numbers from text.

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace tandem::text {

/// The number that `text` consists of; empty if it is none. `base`: of a whole number, if it is not 10.
template <class T, class... Base>
[[nodiscard]] std::optional<T> number(std::string_view text, Base... base) {
  T value{};
  const char* const end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, value, base...);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  return value;
}

}  // namespace tandem::text
