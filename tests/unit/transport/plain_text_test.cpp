#include "sdk/wire/plain_text.hpp"

#include <gtest/gtest.h>

namespace tandem::transport {
namespace {

TEST(PlainText, IsUtf8WithoutControlCharacters) {
  for (const char* text :
       {"", "beyond 100", "J\xC3\xBCrgen", "\xE2\x82\xAC", "\xF0\x9F\x8F\x97", "\xF4\x8F\xBF\xBF"})
    EXPECT_TRUE(is_plain_text(text)) << text;
  for (const char* text : {"a\nb", "\x7F", "\xC2\x85", "\xC3", "\xBC", "\xC0\xAF", "\xE0\x80\xAF",
                           "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xF8\x88\x80\x80\x80", "\xFF"})
    EXPECT_FALSE(is_plain_text(text)) << text;
  EXPECT_FALSE(is_plain_text(std::string_view("a\0b", 3)));
}

TEST(PlainText, ReplacesWhatIsNot) {
  EXPECT_EQ(plain_text("a\nb\xC3", 10), "a?b?");
  EXPECT_EQ(plain_text("J\xC3\xBCrgen", 64), "J\xC3\xBCrgen");
}

TEST(PlainText, IsCutAtTheEndOfACharacter) {
  EXPECT_EQ(plain_text("J\xC3\xBCrgen", 2), "J");
  EXPECT_EQ(plain_text("J\xC3\xBCrgen", 3), "J\xC3\xBC");
  EXPECT_EQ(plain_text("abc", 0), "");
}

}  // namespace
}  // namespace tandem::transport
