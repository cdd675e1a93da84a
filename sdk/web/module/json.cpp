#include "sdk/web/module/json.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace tandem::web {
namespace {

/// Length of the UTF-8 character at the front; 0 if there is none.
std::size_t character_bytes(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::size_t length = byte(0) < 0x80   ? 1
                             : byte(0) < 0xC2 ? 0
                             : byte(0) < 0xE0 ? 2
                             : byte(0) < 0xF0 ? 3
                             : byte(0) < 0xF5 ? 4
                                              : 0;
  if (length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) return 0;
  }
  return length;
}

/// An integer as long as a double's digits may be: 767 of them.
class LongNumber {
 public:
  explicit LongNumber(std::uint64_t number) { add_carry(number); }

  /// The factor is below 2^32.
  void multiply(std::uint64_t factor) {
    std::uint64_t carry = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      carry += words_.at(i) * factor;
      words_.at(i) = carry % kBase;
      carry /= kBase;
    }
    add_carry(carry);
  }
  void multiply(std::uint64_t factor, unsigned times) {
    for (; times != 0; --times) multiply(factor);
  }

  /// Its digits from the first that is not 0; empty for 0.
  [[nodiscard]] std::string digits() const {
    std::string text;
    for (std::size_t i = count_; i-- > 0;) {
      for (std::uint64_t unit = kBase / 10; unit != 0; unit /= 10) {
        const auto digit = static_cast<char>('0' + words_.at(i) / unit % 10);
        if (digit != '0' || !text.empty()) text += digit;
      }
    }
    return text;
  }

 private:
  static constexpr std::uint64_t kBase = 1'000'000'000;

  void add_carry(std::uint64_t carry) {
    for (; carry != 0; carry /= kBase) words_.at(count_++) = carry % kBase;
  }

  std::array<std::uint64_t, 88> words_{};  ///< the last digits first
  std::size_t count_ = 0;
};

/// Rounds to `count` digits, halves to even, and raises the exponent by the number of digits removed.
void round_digits(std::string& digits, int& exponent, std::size_t count) {
  if (digits.size() <= count) return;
  const std::string_view rest = std::string_view(digits).substr(count);
  const bool tie = rest.front() == '5' && rest.find_first_not_of('0', 1) == rest.npos;
  const bool up = tie ? (digits[count - 1] - '0') % 2 == 1 : rest.front() >= '5';
  exponent += static_cast<int>(rest.size());
  digits.resize(count);
  if (!up) return;
  while (!digits.empty() && digits.back() == '9') {
    digits.pop_back();
    ++exponent;
  }
  if (digits.empty()) {
    digits = "1";
  } else {
    ++digits.back();
  }
}

/// Digits and a power of ten as JSON: with a point where printf's %.10g writes one, otherwise with an
/// exponent.
std::string decimal(std::string digits, int exponent) {
  while (digits.size() > 1 && digits.back() == '0') {
    digits.pop_back();
    ++exponent;
  }
  if (digits.empty()) return "0";
  const int first = static_cast<int>(digits.size()) - 1 + exponent;
  if (first < -4 || first >= 10) return digits + "e" + std::to_string(exponent);
  if (exponent >= 0) return digits + std::string(static_cast<std::size_t>(exponent), '0');
  if (first < 0) digits.insert(0, static_cast<std::size_t>(-first), '0');
  digits.insert(digits.size() - static_cast<std::size_t>(-exponent), 1, '.');
  return digits;
}

/// The nearest number of ten digits, as %.10g chooses it. printf itself takes 13 kB of the module.
void append_number(std::string& out, double number) {
  constexpr unsigned kMantissaBits = 52;
  const auto bits = std::bit_cast<std::uint64_t>(number);
  const auto power = static_cast<int>(bits >> kMantissaBits & 0x7FFU);
  std::uint64_t mantissa = bits & ((std::uint64_t{1} << kMantissaBits) - 1);
  if (power != 0) mantissa |= std::uint64_t{1} << kMantissaBits;
  int of_two = std::max(power, 1) - 1075;
  for (; of_two < 0 && mantissa != 0 && mantissa % 2 == 0; ++of_two) mantissa /= 2;
  if (mantissa == 0) of_two = 0;

  // A half is five tenths.
  LongNumber whole(mantissa);
  whole.multiply(of_two < 0 ? 5 : 2, static_cast<unsigned>(std::abs(of_two)));
  std::string digits = whole.digits();
  int exponent = std::min(of_two, 0);
  round_digits(digits, exponent, 10);

  if (std::signbit(number)) out += '-';
  out += decimal(std::move(digits), exponent);
}

}  // namespace

void JsonWriter::separate() {
  if (!first_) out_ += ',';
  first_ = false;
}

JsonWriter& JsonWriter::open(char bracket) {
  separate();
  out_ += bracket;
  first_ = true;
  return *this;
}

JsonWriter& JsonWriter::close(char bracket) {
  out_ += bracket;
  first_ = false;
  return *this;
}

JsonWriter& JsonWriter::name(const char* name) {
  separate();
  out_ += '"';
  for (bool capital = false; *name != 0; ++name) {
    if (*name != '_') out_ += capital && *name >= 'a' ? static_cast<char>(*name - 'a' + 'A') : *name;
    capital = *name == '_';
  }
  out_ += "\":";
  first_ = true;
  return *this;
}

JsonWriter& JsonWriter::value(const char* text) { return value(std::string_view(text)); }

JsonWriter& JsonWriter::value(std::string_view text) {
  separate();
  out_ += '"';
  while (!text.empty()) {
    const std::size_t length = character_bytes(text);
    const char c = text.front();
    if (length == 0) {
      out_ += "\\ufffd";
    } else if (length == 1 && (static_cast<unsigned char>(c) < 0x20 || c == '"' || c == '\\')) {
      constexpr const char* kDigits = "0123456789abcdef";
      out_ += "\\u00";
      out_ += kDigits[static_cast<unsigned char>(c) >> 4U];
      out_ += kDigits[static_cast<unsigned char>(c) & 15U];
    } else {
      out_ += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  out_ += '"';
  return *this;
}

JsonWriter& JsonWriter::value(double number) {
  if (!std::isfinite(number)) return null();
  separate();
  append_number(out_, number);
  return *this;
}

JsonWriter& JsonWriter::value(std::uint64_t number) {
  separate();
  out_ += std::to_string(number);
  return *this;
}

JsonWriter& JsonWriter::value(bool truth) {
  separate();
  out_ += truth ? "true" : "false";
  return *this;
}

JsonWriter& JsonWriter::null() {
  separate();
  out_ += "null";
  return *this;
}

}  // namespace tandem::web
