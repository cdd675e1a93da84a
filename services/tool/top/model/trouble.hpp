#pragma once
// How bad something is.

#include <cstdint>

namespace tandem::top {

enum class Trouble : std::uint8_t {
  kNone,
  kNote,     ///< worth a word
  kWarning,  ///< somebody sees it
  kBad,      ///< somebody cannot play
};

}  // namespace tandem::top
