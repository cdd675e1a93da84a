#include "sdk/web/module/json.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::web {
namespace {

std::string text(std::string_view value) {
  std::string out;
  JsonWriter(out).value(value);
  return out;
}

TEST(Json, ObjectsAndListsHoldWhatIsWrittenInOrder) {
  std::string out;
  JsonWriter json(out);
  json.begin_object().member("a", 1.5).member("b", true).name("c").begin_list();
  json.value(std::uint64_t{1} << 60U).value("x").begin_object().end_object().end_list();
  json.name("d").null().end_object();
  EXPECT_EQ(out, R"({"a":1.5,"b":true,"c":[1152921504606846976,"x",{}],"d":null})");
}

TEST(Json, NumbersThatAreNotFiniteAreNull) {
  std::string out;
  JsonWriter json(out);
  json.begin_list()
      .value(std::numeric_limits<double>::infinity())
      .value(std::numeric_limits<double>::quiet_NaN());
  json.value(-0.25).end_list();
  EXPECT_EQ(out, "[null,null,-0.25]");
}

TEST(Json, NumbersAreThoseOfPrintfWithTenDigits) {
  std::vector<double> numbers{0,
                              -0.0,
                              0.1,
                              1e-4,
                              9.9999999999e-5,
                              1234567890.5,
                              1234567891.5,
                              9999999999.5,
                              1e9,
                              1e10,
                              1e22,
                              -2.5,
                              5e-324,
                              std::numeric_limits<double>::max()};
  std::mt19937_64 random(1);
  for (int i = 0; i < 10'000; ++i) {
    numbers.push_back(std::bit_cast<double>(random()));
    numbers.push_back(static_cast<double>(random() % 1'000'000'000'000) / 1000);
    numbers.push_back(static_cast<double>(random() % 100'000'000'000) + 0.5);
  }
  for (const double number : numbers) {
    if (!std::isfinite(number)) continue;
    char expected[32];
    std::snprintf(expected, sizeof expected, "%.10g", number);
    std::string out;
    JsonWriter(out).value(number);
    EXPECT_EQ(std::bit_cast<std::uint64_t>(std::strtod(out.c_str(), nullptr)),
              std::bit_cast<std::uint64_t>(std::strtod(expected, nullptr)))
        << out << " instead of " << expected;
    if (std::string_view(expected).find('e') == std::string_view::npos) {
      EXPECT_EQ(out, expected);
    }
  }
}

TEST(Json, NamesHaveTheSpellingOfJavaScript) {
  std::string out;
  JsonWriter json(out);
  json.begin_object().member("frame_ms_p50", 0.5).member("rawMbitPerS", 2.0).member("at_", true).end_object();
  EXPECT_EQ(out, R"({"frameMsP50":0.5,"rawMbitPerS":2,"at":true})");
}

TEST(Json, TextsAreEscaped) {
  EXPECT_EQ(text("a\"b\\c\n\x01"), R"("a\u0022b\u005cc\u000a\u0001")");
  EXPECT_EQ(text("\xC3\xA4 \xE2\x82\xAC \xF0\x9F\x98\x80"), "\"\xC3\xA4 \xE2\x82\xAC \xF0\x9F\x98\x80\"");
}

TEST(Json, BytesThatAreNoUtf8AreReplaced) {
  EXPECT_EQ(text("a\xFF"), R"("a\ufffd")");
  EXPECT_EQ(text("\xC3"), R"("\ufffd")");
  EXPECT_EQ(text("\xC3("), R"("\ufffd(")");
  EXPECT_EQ(text("\xC0\x80"), R"("\ufffd\ufffd")");
}

}  // namespace
}  // namespace tandem::web
