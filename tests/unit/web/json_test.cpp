#include "sdk/web/module/json.hpp"

#include <gtest/gtest.h>

#include <limits>

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
