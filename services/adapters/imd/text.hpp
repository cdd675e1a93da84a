#pragma once
// Lines, words and numbers of a topology's text.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "services/program/number.hpp"
#include "tandem/result.hpp"

namespace tandem::imd {

using Words = std::vector<std::string_view>;

/// Without a comment behind `#`.
[[nodiscard]] inline Words words_of(std::string_view line) {
  Words words;
  line = line.substr(0, line.find('#'));
  for (std::size_t at = 0; (at = line.find_first_not_of(" \t\r", at)) != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

template <class T>
[[nodiscard]] std::optional<T> number(std::string_view word) {
  const auto value = text::number<T>(word);
  if constexpr (std::is_floating_point_v<T>)
    if (value && !std::isfinite(*value)) return std::nullopt;
  return value;
}
[[nodiscard]] inline std::optional<double> positive(std::string_view word) {
  const auto value = number<double>(word);
  return value && *value > 0 ? value : std::nullopt;
}

/// Three lengths of a box, if all are above 0.
[[nodiscard]] inline std::optional<std::vector<double>> box_of(std::optional<double> x,
                                                               std::optional<double> y,
                                                               std::optional<double> z) {
  if (!x || !y || !z || !(*x > 0) || !(*y > 0) || !(*z > 0)) return std::nullopt;
  return std::vector<double>{*x, *y, *z};
}

/// The lines of a text, with their numbers.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}
  bool next(std::string_view& line) {
    if (at_ >= text_.size()) return false;
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    line = text_.substr(at_, end - at_);
    at_ = end + 1;
    ++number_;
    return true;
  }
  [[nodiscard]] std::size_t number() const { return number_; }
  [[nodiscard]] tl::unexpected<Error> refuse(const std::string& why) const {
    return fail(ErrorCode::kMalformed, fmt::format("line {}: {}", number_, why));
  }

 private:
  std::string_view text_;
  std::size_t at_ = 0, number_ = 0;
};

}  // namespace tandem::imd
