#include "services/gateway/entrance/guest_book.hpp"

#include <gtest/gtest.h>

namespace tandem::gateway {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

Guest guest(std::string name = "ann") {
  return {.address = "192.0.2.7",
          .origin = "https://lab.example",
          .pass = {.may_act = false, .name = std::move(name), .over_s = 0, .key = 1}};
}

TEST(GuestBook, SaysWhoCameFromWhereDidWhatAndLeft) {
  GuestBook book;
  EXPECT_EQ(book.came(3, guest(), 0),
            "audit: joined viewer=3 from=192.0.2.7 name=\"ann\" role=watch origin=\"https://lab.example\"");
  EXPECT_EQ(book.did(3, "push_acted=0 push_refused=1", 0),
            "audit: inputs viewer=3 from=192.0.2.7 name=\"ann\" push_acted=0 push_refused=1");
  EXPECT_EQ(book.left(3, 2 * kSecondNs), "audit: left viewer=3 from=192.0.2.7 name=\"ann\" after_s=2.0");
  EXPECT_EQ(book.refused("192.0.2.8", "", "token expired", 0),
            "audit: refused from=192.0.2.8 origin=\"\" reason=\"token expired\"");
}

TEST(GuestBook, KnowsNothingOfStrangers) {
  GuestBook book;
  EXPECT_EQ(book.did(9, "push_acted=1", 0), std::nullopt);
  EXPECT_EQ(book.left(9, 0), std::nullopt);
}

TEST(GuestBook, NoTextFromOutsideLooksLikeAnotherKeyOrLine) {
  GuestBook book;
  const auto line = book.came(1, guest("a\" role=act\n\\"), 0);
  ASSERT_TRUE(line);
  EXPECT_NE(line->find("name=\"a? role=act??\" role=watch"), std::string::npos) << *line;
}

TEST(GuestBook, StrangersCannotFillALog) {
  GuestBook book;
  std::size_t lines = 0;
  for (int i = 0; i < 10'000; ++i) lines += book.refused("192.0.2.8", "", "token expired", 0) ? 1U : 0U;
  EXPECT_EQ(lines, 5U);
  const auto later = book.refused("192.0.2.8", "", "token expired", 2 * kSecondNs);
  ASSERT_TRUE(later);
  EXPECT_NE(later->find("left_out=9995"), std::string::npos) << *later;
}

}  // namespace
}  // namespace tandem::gateway
