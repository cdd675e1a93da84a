#pragma once
// Texts for people that travel in messages: UTF-8 without control characters.

#include <cstddef>
#include <string>
#include <string_view>

namespace tandem::transport {

/// The number of bytes of the character of UTF-8 that `text` begins with; 0 if it is empty or ill-formed
/// there.
[[nodiscard]] std::size_t utf8_bytes(std::string_view text);

/// True for well-formed UTF-8 without control characters (U+0000..U+001F, U+007F..U+009F). The empty text is
/// plain.
[[nodiscard]] bool is_plain_text(std::string_view text);

/// The text with '?' in the place of each byte that is_plain_text() would refuse, cut to at most `most_bytes`
/// at the end of a character.
[[nodiscard]] std::string plain_text(std::string_view text, std::size_t most_bytes);

}  // namespace tandem::transport
