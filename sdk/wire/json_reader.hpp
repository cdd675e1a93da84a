#pragma once
// Reads JSON from the network value by value: without a tree of them, and without a library that
// applications would have to load.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "tandem/result.hpp"

namespace tandem::transport {

/// A reader of one text of JSON (RFC 8259), which must outlive it. It has a value at hand: at
/// first the whole text, after each step the member or item that was stepped to. A value can be read once;
/// the next step skips a value that was not read. After the first fault nothing more is read, and finish()
/// says what it was. Time is linear in the text's size.
///
///     JsonReader in(text);
///     if (in.open_object()) {
///       for (std::string name; in.next_member(name);) {
///         if (name == "x") x = in.number().value_or(0);
///       }
///     }
///     if (auto whole = in.finish(); !whole) return whole;
class JsonReader {
 public:
  static constexpr std::size_t kMaxBytes = 1U << 20U;
  static constexpr std::size_t kMaxLevels = 32;  ///< objects and arrays within each other

  explicit JsonReader(std::string_view text);

  /// Goes into the value at hand. False if it is no object or array; then it stays at hand.
  [[nodiscard]] bool open_object();
  [[nodiscard]] bool open_array();
  /// To the next member or item of what was opened last. False at its end, which closes it.
  [[nodiscard]] bool next_member(std::string& name);
  [[nodiscard]] bool next_item();
  /// Reads the value at hand. Empty if it is of another kind (then it stays at hand), or a number that no
  /// double holds.
  [[nodiscard]] std::optional<double> number();
  [[nodiscard]] std::optional<std::string> text();

  /// Passes over the rest. Errors: kMalformed, naming the line and what is wrong there.
  [[nodiscard]] Result<void> finish();

 private:
  bool wrong(const char* what);
  [[nodiscard]] bool starts_with(char c) const { return at_ < text_.size() && text_[at_] == c; }
  void skip_space();
  bool take(char c);
  bool open(char bracket);
  bool step(std::string* name);
  void pass_over();
  void scalar();
  std::string_view digits();
  std::string_view number_text();
  bool string(std::string* out);
  bool escape(std::string* out);
  std::optional<unsigned> code_unit();

  std::string_view text_;
  std::size_t at_ = 0;
  std::array<bool, kMaxLevels> is_object_{};
  std::size_t levels_ = 0;
  bool at_hand_ = true;  // a value begins at at_
  bool first_ = true;    // nothing of the innermost level was read
  const char* wrong_ = nullptr;
};

}  // namespace tandem::transport
