#include "services/tool/top/screen/text.hpp"

#include <fmt/format.h>
#include <langinfo.h>
#include <wchar.h>
#include <wctype.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "sdk/wire/plain_text.hpp"

namespace tandem::top {
namespace {

/// The size of a character of well-formed UTF-8 by its first byte.
std::size_t bytes_of(char first) {
  const auto byte = static_cast<unsigned char>(first);
  return byte < 0x80 ? 1 : byte < 0xE0 ? 2 : byte < 0xF0 ? 3 : 4;
}

wchar_t point_of(std::string_view character) {
  const auto byte = [character](std::size_t i) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(character[i]));
  };
  if (character.size() == 1) return static_cast<wchar_t>(byte(0));
  std::uint32_t point = byte(0) & (0x7FU >> character.size());
  for (std::size_t i = 1; i < character.size(); ++i) point = point << 6U | (byte(i) & 0x3FU);
  return static_cast<wchar_t>(point);
}

/// The columns of a character, 0 for one that must not be shown.
std::size_t width_of(std::string_view character) {
  const wchar_t point = point_of(character);
  if (point < 0x80) return point >= 0x20 && point != 0x7F ? 1 : 0;
  const int columns = iswprint(static_cast<wint_t>(point)) != 0 ? wcwidth(point) : 0;
  return columns == 1 || columns == 2 ? static_cast<std::size_t>(columns) : 0;
}

template <class Visit>
void for_each_character(std::string_view text, const Visit& visit) {
  while (!text.empty()) {
    const std::size_t size = std::min(bytes_of(text.front()), text.size());
    if (!visit(text.substr(0, size))) return;
    text.remove_prefix(size);
  }
}

}  // namespace

Alphabet alphabet_of_locale() {
  return std::strcmp(nl_langinfo(CODESET), "UTF-8") == 0 ? Alphabet::kUnicode : Alphabet::kAscii;
}

std::string shown(std::string_view text, Alphabet alphabet) {
  const std::string plain = transport::plain_text(text, text.size());
  std::string out;
  for_each_character(plain, [&](std::string_view character) {
    const bool fits = character.size() == 1 || alphabet == Alphabet::kUnicode;
    out += fits && width_of(character) > 0 ? character : std::string_view("?");
    return true;
  });
  return out;
}

std::size_t columns_of(std::string_view text) {
  std::size_t columns = 0;
  for_each_character(text, [&columns](std::string_view character) {
    columns += width_of(character);
    return true;
  });
  return columns;
}

std::size_t bytes_within(std::string_view text, std::size_t columns) {
  std::size_t used = 0, bytes = 0;
  for_each_character(text, [&](std::string_view character) {
    used += width_of(character);
    if (used > columns) return false;
    bytes += character.size();
    return true;
  });
  return bytes;
}

std::string cut(std::string_view text, std::size_t columns) {
  if (columns_of(text) <= columns) return std::string(text);
  if (columns == 0) return {};
  return std::string(text.substr(0, bytes_within(text, columns - 1))) + '~';
}

std::string cell(std::string_view text, std::size_t columns, Align align, Alphabet alphabet) {
  std::string fitted = cut(shown(text, alphabet), columns);
  const std::string blank(columns - std::min(columns, columns_of(fitted)), ' ');
  return align == Align::kLeft ? fitted + blank : blank + fitted;
}

std::string number(double value, int decimals, std::size_t columns) {
  if (!std::isfinite(value)) return "-";
  for (int shown_decimals = decimals; shown_decimals >= 0; --shown_decimals) {
    std::string text = std::abs(value) < 1e15 ? fmt::format("{:.{}f}", value, shown_decimals) : std::string();
    if (!text.empty() && text.size() <= columns) return text;
  }
  std::string text = short_bytes(std::abs(value));
  if (value < 0) text.insert(0, "-");
  return text.size() <= columns ? text : "-";
}

std::string short_bytes(double bytes) {
  constexpr std::array<const char*, 7> kUnits{"", "k", "M", "G", "T", "P", "E"};
  if (!std::isfinite(bytes) || bytes < 0) return "-";
  std::size_t unit = 0;
  while (bytes >= 999.5 && unit + 1 < kUnits.size()) {
    bytes /= 1000;
    ++unit;
  }
  return bytes < 1e6 ? fmt::format("{:.0f}{}", bytes, kUnits.at(unit)) : "-";
}

std::string sparkline(std::span<const double> values, double most, Alphabet alphabet) {
  constexpr std::array<const char*, 8> kBlocks{"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  constexpr std::string_view kAscii = "_.-:=+*#";
  std::string out;
  for (const double value : values) {
    if (!std::isfinite(value)) {
      out += ' ';
      continue;
    }
    const double part = most > 0 ? std::clamp(value / most, 0.0, 1.0) : 0;
    const auto level = static_cast<std::size_t>(std::lround(part * 7));
    if (alphabet == Alphabet::kUnicode) {
      out += kBlocks.at(level);
    } else {
      out += kAscii[level];
    }
  }
  return out;
}

std::string bar(double part, double mark, std::size_t columns, Alphabet alphabet) {
  const auto place = [columns](double of) {
    const double clamped = std::isfinite(of) ? std::clamp(of, 0.0, 1.0) : 0;
    return static_cast<std::size_t>(std::lround(clamped * static_cast<double>(columns)));
  };
  const std::size_t filled = place(part), marked = place(mark);
  std::string out = "[";
  for (std::size_t i = 0; i < columns; ++i) {
    const bool unicode = alphabet == Alphabet::kUnicode;
    if (i < filled) {
      out += unicode ? "█" : "#";
    } else if (i + 1 == marked) {
      out += '|';
    } else {
      out += unicode ? "·" : ".";
    }
  }
  return out + "]";
}

}  // namespace tandem::top
