// The reader of JSON.
#include "sdk/wire/json_reader.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>
#include <vector>

namespace tandem::transport {
namespace {

std::string fault(std::string_view text) {
  const auto whole = JsonReader(text).finish();
  return whole ? "" : whole.error().message;
}

std::optional<double> number(std::string_view text) {
  JsonReader in(text);
  const auto value = in.number();
  return in.finish() ? value : std::nullopt;
}

std::optional<std::string> string(std::string_view text) {
  JsonReader in(text);
  auto value = in.text();
  return in.finish() ? value : std::nullopt;
}

TEST(JsonReaders, GoThroughMembersAndItemsInTheirOrder) {
  JsonReader in(R"( { "a" : 1.5 , "b":[ "x", {"deep": [[]]}, -2e1 ],"c":{}, "":true, "d":null } )");
  std::string seen, name;
  ASSERT_TRUE(in.open_object());
  while (in.next_member(name)) {
    seen += name + ';';
    if (name == "a") {
      EXPECT_EQ(in.number(), 1.5);
    }
    if (name != "b") continue;
    ASSERT_TRUE(in.open_array());
    ASSERT_TRUE(in.next_item());
    EXPECT_FALSE(in.number()) << "it is of another kind and stays at hand";
    EXPECT_EQ(in.text(), "x");
    EXPECT_FALSE(in.text()) << "it was read";
    ASSERT_TRUE(in.next_item());
    ASSERT_TRUE(in.next_item()) << "what is not read is passed over";
    EXPECT_EQ(in.number(), -20);
    EXPECT_FALSE(in.next_item());
  }
  EXPECT_EQ(seen, "a;b;c;;d;");
  EXPECT_TRUE(in.finish());
}

TEST(JsonReaders, FinishPassesOverWhatIsStillOpen) {
  JsonReader in(R"({"a": [{"b": [1, 2], "c": 3}], "d": 4})");
  std::string name;
  ASSERT_TRUE(in.open_object() && in.next_member(name) && in.open_array() && in.next_item());
  ASSERT_TRUE(in.open_object() && in.next_member(name));
  EXPECT_TRUE(in.finish());
}

TEST(JsonReaders, NumbersAreThoseOfTheGrammar) {
  EXPECT_EQ(number("-0.5e+2"), -50);
  EXPECT_EQ(number("1E2"), 100);
  EXPECT_EQ(number("9007199254740993"), 9007199254740992.0);
  EXPECT_EQ(number("4.9406564584124654e-324"), 4.9406564584124654e-324);
  for (const char* text :
       {"01", "-", "+1", ".5", "1.", "1e", "1e+", "0x1", "nan", "NaN", "Infinity", "1f", "--1"})
    EXPECT_NE(fault(text), "") << text;
  EXPECT_FALSE(number("1e999")) << "no double holds it";
  EXPECT_EQ(fault("1e999"), "") << "but it is JSON";
  EXPECT_EQ(fault(std::string(100'000, '7')), "");
}

TEST(JsonReaders, StringsAreUtf8WithEscapes) {
  EXPECT_EQ(string(R"("\"\\\/\b\f\n\r\t\u0041\u00e9\u20AC\uD83D\uDE00\u0000")"),
            std::string("\"\\/\b\f\n\r\tA\xC3\xA9\xE2\x82\xAC\xF0\x9F\x98\x80\0", 19));
  EXPECT_EQ(string("\"\xF0\x9F\x98\x80\x7F\xC2\x80\""), "\xF0\x9F\x98\x80\x7F\xC2\x80");
  for (const char* text :
       {R"("\uD83D")", R"("\uD83Dx")", R"("\uD83D\n")", R"("\uD83D\u0041")", R"("\uDE00")", R"("\u12")",
        R"("\u12G4")", R"("\u-123")", R"("\x41")", R"("\)", R"("open)", "\"\n\"", "\"\x01\"", "\"\xFF\"",
        "\"\xC0\x80\"", "\"\xED\xA0\x80\"", "\"\xE2\x82\"", "'x'"})
    EXPECT_NE(fault(text), "") << text;
}

TEST(JsonReaders, WhatIsNoJsonIsRefusedWithItsLine) {
  EXPECT_EQ(fault("{\"a\":\n\n 1"), "line 3: ',' or '}' is missing");
  EXPECT_EQ(fault("[1,\n]"), "line 2: a value is missing");
  EXPECT_EQ(fault("{1: 2}"), "line 1: a member's name is missing");
  EXPECT_EQ(fault("{\"a\" 2}"), "line 1: ':' is missing");
  EXPECT_EQ(fault("1 2"), "line 1: more than one value");
  EXPECT_EQ(fault(""), "line 1: a value is missing");
  for (const char* text : {"{", "[", "}", "]", "{]", "[}", "[1 2]", "{\"a\":1,}", "[,1]", "{\"a\":}", "tru",
                           "nul", "True", "/* */ 1",
                           "\xEF\xBB\xBF"
                           "1",
                           "{\"a\":1 \"b\":2}"})
    EXPECT_NE(fault(text), "") << text;
  EXPECT_NE(fault(std::string(4, '\0')), "");
}

TEST(JsonReaders, AfterAFaultNothingMoreIsRead) {
  JsonReader in("[1 2]");
  ASSERT_TRUE(in.open_array() && in.next_item());
  EXPECT_FALSE(in.next_item());
  EXPECT_FALSE(in.next_item());
  EXPECT_FALSE(in.number());
  EXPECT_FALSE(in.open_object());
  EXPECT_FALSE(in.finish());
}

TEST(JsonReaders, SizeAndDepthAreBounded) {
  const auto nested = [](std::size_t levels) { return std::string(levels, '[') + std::string(levels, ']'); };
  EXPECT_EQ(fault(nested(JsonReader::kMaxLevels)), "");
  EXPECT_EQ(fault(nested(JsonReader::kMaxLevels + 1)), "line 1: more than 32 levels");
  EXPECT_EQ(fault(std::string(500'000, '[')), "line 1: more than 32 levels");
  EXPECT_EQ(fault("1" + std::string(JsonReader::kMaxBytes - 1, ' ')), "");
  EXPECT_EQ(fault("1" + std::string(JsonReader::kMaxBytes, ' ')), "line 1: more than 1 MiB");
}

/// What another reader says.
class OtherReader : public nlohmann::json_sax<nlohmann::json> {
 public:
  bool null() override { return true; }
  bool boolean(bool /*value*/) override { return true; }
  bool number_integer(number_integer_t value) override { return add(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return add(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return add(value); }
  bool string(string_t& value) override { return add(value); }
  bool binary(binary_t& /*value*/) override { return false; }
  bool start_object(std::size_t /*size*/) override { return true; }
  bool key(string_t& value) override { return add(value); }
  bool end_object() override { return true; }
  bool start_array(std::size_t /*size*/) override { return true; }
  bool end_array() override { return true; }
  bool parse_error(std::size_t /*at*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& why) override {
    too_large = why.id == 406;
    return false;
  }
  std::string said;
  bool too_large = false;  // a number that no double holds, which we pass over

 private:
  bool add(double value) { return add(nlohmann::json(value == 0 ? 0.0 : value).dump()); }
  bool add(const std::string& text) {
    said += text + ' ';
    return true;
  }
};

void read_all(JsonReader& in, std::string& said) {
  std::string name;
  if (in.open_object()) {
    while (in.next_member(name)) {
      said += name + ' ';
      read_all(in, said);
    }
  } else if (in.open_array()) {
    while (in.next_item()) read_all(in, said);
  } else if (const auto value = in.number()) {
    said += nlohmann::json(*value == 0 ? 0.0 : *value).dump() + ' ';
  } else if (const auto text = in.text()) {
    said += *text + ' ';
  }
}

// Half of the texts are JSON of which a few bytes are changed.
TEST(JsonReaders, AgreeWithAnotherReaderOnTextsMadeAtRandom) {
  const std::vector<std::string> pieces{
      "{",       "}",        "[",    "]",    ",",     ":",    "\"a\"", "\"", "\\",          "1",
      "-2.5",    "0",        "e",    "3e-7", "true",  "null", " ",     "\n", "\"\\u00e9\"", "\\ud83d\\ude00",
      "\\ud83d", "\xC3\xA9", "\xFF", "x",    "\"b\":"};
  const std::string whole =
      R"({"planes":[{"normal":{"x":0.6,"y":-8E-1},"\u0074hrough":{}},[]],"d":"\ud83d\ude00 \"q\" é","t":[true,false,null,-0,1e5]})";
  std::mt19937 random(1);  // NOLINT(*-msc51-cpp): the same texts each time
  std::size_t good = 0;
  for (int run = 0; run < 40'000; ++run) {
    std::string text;
    if (run % 2 == 0) {
      for (std::size_t i = random() % 12; i > 0; --i) text += pieces[random() % pieces.size()];
    } else {
      text = whole;
      for (std::size_t i = random() % 3; i > 0; --i)
        text.replace(random() % text.size(), random() % 3, pieces[random() % pieces.size()]);
    }
    OtherReader other;
    const bool theirs = nlohmann::json::sax_parse(text, &other);
    if (other.too_large) continue;
    std::string said;
    JsonReader in(text);
    read_all(in, said);
    const auto ours = in.finish();
    ASSERT_EQ(ours.has_value(), theirs) << text << '\n' << (ours ? "" : ours.error().message);
    if (!theirs) continue;
    ASSERT_EQ(said, other.said) << text;
    ++good;
  }
  EXPECT_GT(good, 4'000U);
}

}  // namespace
}  // namespace tandem::transport
