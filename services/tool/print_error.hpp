#pragma once
// Lines for humans on stderr.

#include <cstdio>
#include <string>

namespace tandem::tool {

/// As far as stderr takes it: fmt::print would throw where it takes no more, and end a run for the sake of a
/// line.
inline void print_error(const std::string& text) { std::fputs(text.c_str(), stderr); }

}  // namespace tandem::tool
