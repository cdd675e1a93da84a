#include "sdk/wire/text_message.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace tandem::transport {
namespace {

constexpr std::size_t kMaxBytes = 1U << 20U;
constexpr int kMaxLevels = 16;
constexpr std::size_t kMaxFields = 100'000;

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// A recursive descent parser. It stops at the first fault.
class TextReader {
 public:
  explicit TextReader(std::string_view text) : text_(text) {}

  Result<TextMessage> read() {
    TextMessage message;
    if (!fields(message, '\0', 0)) {
      const auto line = 1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n');
      return fail(ErrorCode::kMalformed, "the scene's text, line " + std::to_string(line) + ": " + wrong_);
    }
    return message;
  }

 private:
  bool wrong(const char* what) {
    wrong_ = what;
    return false;
  }
  [[nodiscard]] char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  void skip_space() {
    while (at_ < text_.size()) {
      if (text_[at_] == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (is_space(text_[at_])) {
        ++at_;
      } else {
        return;
      }
    }
  }
  bool take(char c) {
    skip_space();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  bool count_field() { return ++fields_ <= kMaxFields || wrong("too many fields"); }

  /// Reads up to and including `end`; 0 is the end of the text.
  bool fields(TextMessage& message, char end, int depth) {
    if (depth > kMaxLevels) return wrong("too many levels");
    for (;;) {
      skip_space();
      if (at_ == text_.size()) return end == '\0' || wrong("a message does not end");
      if (end != '\0' && take(end)) return true;
      if (!field(message, depth)) return false;
    }
  }

  bool field(TextMessage& message, int depth) {
    const std::string_view name = word();
    if (name.empty()) return wrong("a field's name is missing");
    const bool colon = take(':');
    if (take('[')) {
      while (!take(']')) {
        if (!value(message, name, true, depth)) return false;
        take(',');
      }
    } else if (!value(message, name, colon, depth)) {
      return false;
    }
    if (!take(',')) take(';');
    return true;
  }

  bool value(TextMessage& message, std::string_view name, bool scalar, int depth) {
    if (!count_field()) return false;
    TextField& field = message.emplace_back();
    field.name = name;
    for (const auto& [begin, end] : {std::pair('{', '}'), std::pair('<', '>')}) {
      if (!take(begin)) continue;
      field.is_message = true;
      return fields(field.message, end, depth + 1);
    }
    if (!scalar) return wrong("':' or '{' is missing");
    skip_space();
    if (peek() == '"' || peek() == '\'') return strings(field.scalar);
    const std::size_t from = at_;
    if (peek() == '-' || peek() == '+') ++at_;
    while (is_letter(peek()) || is_digit(peek()) || peek() == '.' || is_exponent_sign(from)) ++at_;
    field.scalar = text_.substr(from, at_ - from);
    return at_ != from || wrong("a value is missing");
  }

  [[nodiscard]] bool is_exponent_sign(std::size_t from) const {
    return (peek() == '-' || peek() == '+') && at_ > from && (text_[at_ - 1] == 'e' || text_[at_ - 1] == 'E');
  }

  /// Reads adjacent strings and returns the first, without escapes resolved. No field that is read needs
  /// more.
  bool strings(std::string_view& first) {
    bool some = false;
    for (skip_space(); peek() == '"' || peek() == '\''; skip_space()) {
      const char quote = text_[at_++];
      const std::size_t from = at_;
      while (at_ < text_.size() && text_[at_] != quote && text_[at_] != '\n')
        at_ += text_[at_] == '\\' ? std::size_t{2} : std::size_t{1};
      if (at_ >= text_.size() || text_[at_] != quote) {
        at_ = std::min(at_, text_.size());
        return wrong("a string does not end");
      }
      if (!std::exchange(some, true)) first = text_.substr(from, at_ - from);
      ++at_;
    }
    return true;
  }

  std::string_view word() {
    skip_space();
    const std::size_t from = at_;
    if (is_letter(peek())) {
      while (is_letter(peek()) || is_digit(peek())) ++at_;
    }
    return text_.substr(from, at_ - from);
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t fields_ = 0;
  const char* wrong_ = "";
};

// The last of several values counts, as in protobuf.
const TextField* last(const TextMessage* message, std::string_view name) {
  if (message == nullptr) return nullptr;
  const auto found =
      std::find_if(message->rbegin(), message->rend(), [&](const TextField& f) { return f.name == name; });
  return found == message->rend() ? nullptr : &*found;
}

}  // namespace

Result<TextMessage> read_text_message(std::string_view text) {
  if (text.size() > kMaxBytes) return fail(ErrorCode::kMalformed, "the scene's text is longer than 1 MiB");
  return TextReader(text).read();
}

const TextMessage* child(const TextMessage* message, std::string_view name) {
  const TextField* field = last(message, name);
  return field != nullptr && field->is_message ? &field->message : nullptr;
}

std::string_view scalar(const TextMessage* message, std::string_view name) {
  const TextField* field = last(message, name);
  return field != nullptr && !field->is_message ? field->scalar : std::string_view();
}

}  // namespace tandem::transport
