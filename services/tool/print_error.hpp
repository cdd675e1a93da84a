#pragma once
// Lines for humans on stderr.

#include <cstdio>
#include <string>

namespace tandem::tool {

/// Writes as much as stderr takes. fmt::print would throw if it takes no more, and end the program because of
/// one line.
inline void print_error(const std::string& text) { std::fputs(text.c_str(), stderr); }

}  // namespace tandem::tool
