#pragma once
// Text for a terminal: nothing that comes from the network reaches it but characters that it shows as they
// are.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace tandem::top {

/// What a terminal can show.
enum class Alphabet : bool {
  kAscii,
  kUnicode,  ///< as UTF-8; the process's LC_CTYPE must be UTF-8, too
};
/// By the process's LC_CTYPE.
[[nodiscard]] Alphabet alphabet_of_locale();

/// The text with '?' in the place of everything that a terminal does not show as a character of one or two
/// columns: control characters, escape sequences, characters that change the direction or combine, bytes that
/// are no UTF-8.
[[nodiscard]] std::string shown(std::string_view text, Alphabet alphabet);

/// The number of columns of a text that shown() returned.
[[nodiscard]] std::size_t columns_of(std::string_view text);

/// The beginning of a text that shown() returned, at most `columns` wide; the last character is '~' if
/// something is left out.
[[nodiscard]] std::string cut(std::string_view text, std::size_t columns);
/// The bytes of the longest beginning of such a text that is at most `columns` wide.
[[nodiscard]] std::size_t bytes_within(std::string_view text, std::size_t columns);
enum class Align : bool { kLeft, kRight };
/// shown(), cut and filled up to exactly `columns`.
[[nodiscard]] std::string cell(std::string_view text, std::size_t columns, Align align, Alphabet alphabet);

/// A number in at most `columns` (at least 4), with at most `decimals` decimals; "-" if it is not finite.
[[nodiscard]] std::string number(double value, int decimals, std::size_t columns);
/// The number of bytes in at most five characters.
[[nodiscard]] std::string short_bytes(double bytes);

/// One column for each value, the highest for `most` and above. A value that is not a number is blank.
[[nodiscard]] std::string sparkline(std::span<const double> values, double most, Alphabet alphabet);
/// A bar of `columns` between brackets: filled to `part` of 1, with a mark at `mark`.
[[nodiscard]] std::string bar(double part, double mark, std::size_t columns, Alphabet alphabet);

}  // namespace tandem::top
