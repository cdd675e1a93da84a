#pragma once
// What a screen shows, before anything is drawn.

#include <cstdint>
#include <string>
#include <vector>

#include "services/tool/top/model/trouble.hpp"

namespace tandem::top {

enum class Style : std::uint8_t { kNormal, kDim, kStrong, kHeader, kChosen, kWarning, kBad };

/// A part of a line, made by the functions of text.hpp.
struct Part {
  std::string text;
  Style style = Style::kNormal;
};

struct Line {
  std::vector<Part> parts;
  Line() = default;
  Line(std::string text, Style style = Style::kNormal) { add(std::move(text), style); }
  Line& add(std::string text, Style style = Style::kNormal) {
    parts.push_back({std::move(text), style});
    return *this;
  }
  [[nodiscard]] std::string text() const {
    std::string all;
    for (const Part& part : parts) all += part.text;
    return all;
  }
};

/// Lines from the top. The terminal cuts what does not fit.
using Page = std::vector<Line>;

[[nodiscard]] inline Style style_of(Trouble trouble) {
  switch (trouble) {
    case Trouble::kNone:
    case Trouble::kNote:
      return Style::kNormal;
    case Trouble::kWarning:
      return Style::kWarning;
    case Trouble::kBad:
      return Style::kBad;
  }
  return Style::kNormal;
}

}  // namespace tandem::top
