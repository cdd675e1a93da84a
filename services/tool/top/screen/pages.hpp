#pragma once
// Composes what the screen shows. Nothing here draws, so tests read the lines.

#include <cstdint>
#include <string>
#include <vector>

#include "services/tool/top/screen/page.hpp"
#include "services/tool/top/screen/view.hpp"

namespace tandem::top {

struct Size {
  std::size_t columns = 100, lines = 30;
};

/// The page of the panel that is chosen: at most `size.lines` lines, each at most `size.columns` wide.
[[nodiscard]] Page compose(const Overview& overview, const View& view, const Rows& rows, std::uint32_t domain,
                           Size size, Moment now, Alphabet alphabet);

/// The tables with the reasons of all clients that have trouble, as text with a line break behind each line.
[[nodiscard]] std::string print(const Overview& overview, std::size_t columns, Moment now, Alphabet alphabet);

/// The text in lines of at most `columns`, broken between words.
[[nodiscard]] std::vector<std::string> wrap(std::string_view text, std::size_t columns, Alphabet alphabet);

}  // namespace tandem::top
