#include "sdk/wire/plain_text.hpp"

#include <cstdint>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::transport {
std::size_t utf8_bytes(std::string_view text) {
  const auto byte = [text](std::size_t i) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(text[i]));
  };
  if (text.empty()) return 0;
  const std::uint32_t first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t size = first < 0xC0 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF8 ? 4 : 0;
  if (size == 0 || text.size() < size) return 0;
  std::uint32_t point = first & (0x7FU >> size);
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) return 0;
    point = point << 6U | (byte(i) & 0x3FU);
  }
  // Below: the longer form of a shorter character. Surrogates are no characters.
  const std::uint32_t least = size == 2 ? 0x80 : size == 3 ? 0x800 : 0x10000;
  return point < least || point > 0x10FFFF || (point >= 0xD800 && point < 0xE000) ? 0 : size;
}

namespace {

/// The number of bytes of the plain character that `text` begins with; 0 if it begins with none.
std::size_t character_bytes(std::string_view text) {
  const std::size_t size = utf8_bytes(text);
  const auto byte = [text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const bool control =
      (size == 1 && (byte(0) < 0x20 || byte(0) == 0x7F)) || (size == 2 && byte(0) == 0xC2 && byte(1) < 0xA0);
  return control ? 0 : size;
}

}  // namespace

bool is_plain_text(std::string_view text) {
  while (!text.empty()) {
    const std::size_t size = character_bytes(text);
    if (size == 0) return false;
    text.remove_prefix(size);
  }
  return true;
}

std::string plain_text(std::string_view text, std::size_t most_bytes) {
  std::string plain;
  while (!text.empty()) {
    const std::size_t size = character_bytes(text);
    const std::size_t taken = size == 0 ? 1 : size;
    if (plain.size() + taken > most_bytes) break;
    size == 0 ? plain += '?' : plain += text.substr(0, size);
    text.remove_prefix(taken);
  }
  TANDEM_ASSERT(plain.size() <= most_bytes && is_plain_text(plain));
  return plain;
}

}  // namespace tandem::transport
