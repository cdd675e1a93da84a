#include "sdk/wire/json_reader.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/plain_text.hpp"

namespace tandem::transport {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

void append_utf8(std::uint32_t point, std::string& out) {
  const auto put = [&](std::uint32_t byte) { out += static_cast<char>(static_cast<unsigned char>(byte)); };
  if (point < 0x80) return put(point);
  if (point < 0x800) {
    put(0xC0U | point >> 6U);
  } else if (point < 0x10000) {
    put(0xE0U | point >> 12U);
    put(0x80U | (point >> 6U & 0x3FU));
  } else {
    put(0xF0U | point >> 18U);
    put(0x80U | (point >> 12U & 0x3FU));
    put(0x80U | (point >> 6U & 0x3FU));
  }
  put(0x80U | (point & 0x3FU));
}

}  // namespace

JsonReader::JsonReader(std::string_view text) : text_(text) {
  if (text.size() > kMaxBytes) wrong("more than 1 MiB");
  skip_space();
}

bool JsonReader::wrong(const char* what) {
  if (wrong_ == nullptr) wrong_ = what;
  at_hand_ = false;
  levels_ = 0;
  return false;
}

void JsonReader::skip_space() {
  while (starts_with(' ') || starts_with('\n') || starts_with('\r') || starts_with('\t')) ++at_;
}

bool JsonReader::take(char c) {
  if (!starts_with(c)) return false;
  ++at_;
  return true;
}

bool JsonReader::open(char bracket) {
  if (!at_hand_ || !starts_with(bracket)) return false;
  if (levels_ == kMaxLevels) return wrong("more than 32 levels");
  ++at_;
  is_object_[levels_++] = bracket == '{';
  at_hand_ = false;
  first_ = true;
  return true;
}

bool JsonReader::open_object() { return open('{'); }
bool JsonReader::open_array() { return open('['); }

// The next value of the innermost level.
bool JsonReader::step(std::string* name) {
  if (at_hand_) pass_over();
  if (wrong_ != nullptr) return false;
  TANDEM_ASSERT(levels_ > 0);
  const bool in_object = is_object_[levels_ - 1];
  skip_space();
  if (take(in_object ? '}' : ']')) {
    --levels_;
    first_ = false;
    return false;
  }
  if (!std::exchange(first_, false) && !take(','))
    return wrong(in_object ? "',' or '}' is missing" : "',' or ']' is missing");
  skip_space();
  if (in_object) {
    if (!starts_with('"')) return wrong("a member's name is missing");
    if (!string(name)) return false;
    skip_space();
    if (!take(':')) return wrong("':' is missing");
    skip_space();
  }
  return at_hand_ = true;
}

bool JsonReader::next_member(std::string& name) {
  name.clear();
  return step(&name);
}
bool JsonReader::next_item() { return step(nullptr); }

// Without recursion, and without keeping anything.
void JsonReader::pass_over() {
  const std::size_t outside = levels_;
  do {
    if (!at_hand_) {
      step(nullptr);
    } else if (!open_object() && !open_array()) {
      scalar();
    }
  } while (levels_ > outside);
}

void JsonReader::scalar() {
  if (!at_hand_) return;
  at_hand_ = false;
  if (starts_with('"')) {
    string(nullptr);
    return;
  }
  if (starts_with('-') || (at_ < text_.size() && is_digit(text_[at_]))) {
    number_text();
    return;
  }
  for (const std::string_view word : {"true", "false", "null"}) {
    if (text_.substr(at_, word.size()) != word) continue;
    at_ += word.size();
    return;
  }
  wrong("a value is missing");
}

std::string_view JsonReader::digits() {
  const std::size_t from = at_;
  while (at_ < text_.size() && is_digit(text_[at_])) ++at_;
  if (at_ == from) wrong("a number lacks a digit");
  return text_.substr(from, at_ - from);
}

std::string_view JsonReader::number_text() {
  const std::size_t from = at_;
  take('-');
  if (const std::string_view whole = digits(); whole.size() > 1 && whole.front() == '0')
    wrong("a number begins with a zero");
  if (take('.')) digits();
  if (take('e') || take('E')) {
    if (!take('+')) take('-');
    digits();
  }
  return text_.substr(from, at_ - from);
}

std::optional<double> JsonReader::number() {
  if (!at_hand_ || !(starts_with('-') || (at_ < text_.size() && is_digit(text_[at_])))) return std::nullopt;
  at_hand_ = false;
  const std::string_view text = number_text();
  if (wrong_ != nullptr) return std::nullopt;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  TANDEM_ASSERT(end == text.data() + text.size());
  if (error != std::errc()) return std::nullopt;
  return value;
}

std::optional<std::string> JsonReader::text() {
  if (!at_hand_ || !starts_with('"')) return std::nullopt;
  at_hand_ = false;
  std::string out;
  if (!string(&out)) return std::nullopt;
  return out;
}

bool JsonReader::string(std::string* out) {
  ++at_;
  while (at_ < text_.size() && text_[at_] != '"') {
    if (text_[at_] == '\\') {
      if (!escape(out)) return false;
      continue;
    }
    const std::size_t size = utf8_bytes(text_.substr(at_));
    if (size == 0) return wrong("a string is not UTF-8");
    if (static_cast<unsigned char>(text_[at_]) < 0x20) return wrong("a control character in a string");
    if (out != nullptr) *out += text_.substr(at_, size);
    at_ += size;
  }
  return take('"') || wrong("a string does not end");
}

bool JsonReader::escape(std::string* out) {
  ++at_;
  constexpr std::string_view kLetters = "\"\\/bfnrt", kMeanings = "\"\\/\b\f\n\r\t";
  std::uint32_t point = 0;
  if (take('u')) {
    const auto unit = code_unit();
    if (!unit) return false;
    point = *unit;
    if (point >= 0xD800 && point < 0xE000) {
      // Half of a pair of UTF-16; the other half follows.
      if (point >= 0xDC00 || !take('\\') || !take('u')) return wrong("half a character in a string");
      const auto low = code_unit();
      if (!low) return false;
      if (*low < 0xDC00 || *low >= 0xE000) return wrong("half a character in a string");
      point = 0x10000 + ((point - 0xD800) << 10U) + (*low - 0xDC00);
    }
  } else {
    const std::size_t at = at_ < text_.size() ? kLetters.find(text_[at_]) : std::string_view::npos;
    if (at == std::string_view::npos) return wrong("an unknown escape in a string");
    ++at_;
    point = static_cast<unsigned char>(kMeanings[at]);
  }
  if (out != nullptr) append_utf8(point, *out);
  return true;
}

std::optional<unsigned> JsonReader::code_unit() {
  const std::string_view hex = text_.substr(at_, 4);
  unsigned unit = 0;
  const auto [end, error] = std::from_chars(hex.data(), hex.data() + hex.size(), unit, 16);
  if (hex.size() < 4 || error != std::errc() || end != hex.data() + hex.size()) {
    wrong("an unknown escape in a string");
    return std::nullopt;
  }
  at_ += hex.size();
  return unit;
}

Result<void> JsonReader::finish() {
  while (levels_ > 0) step(nullptr);
  if (at_hand_) pass_over();
  skip_space();
  if (at_ < text_.size()) wrong("more than one value");
  if (wrong_ == nullptr) return {};
  const auto line = 1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n');
  return fail(ErrorCode::kMalformed, "line " + std::to_string(line) + ": " + wrong_);
}

}  // namespace tandem::transport
