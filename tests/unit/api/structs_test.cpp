// Structs of other headers than the library's.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <vector>

#include "sdk/client/api/structs.hpp"
#include "tests/support/playground/playground.hpp"

namespace tandem::api {
namespace {

/// A struct as a newer header has it.
template <class T>
struct Newer {
  T known;
  std::array<std::uint8_t, 40> more{};
};

TEST(Structs, OfANewerHeaderMayNotAskForWhatIsUnknown) {
  Playground playground;
  Newer<tandem_options> options{TANDEM_OPTIONS_INIT};
  options.known.size = sizeof options;
  options.known.background = 0;
  tandem_client client = 0;
  EXPECT_EQ(playground.join(&options.known, &client), TANDEM_OK);
  EXPECT_EQ(tandem_leave(client), TANDEM_OK);
  options.more.back() = 1;
  EXPECT_EQ(playground.join(&options.known, &client), TANDEM_UNSUPPORTED);
}

TEST(Structs, OfANewerHeaderAreFilledInAsFarAsKnown) {
  Playground playground;
  const tandem_client client = playground.join();
  Newer<tandem_status> status{TANDEM_STATUS_INIT};
  status.known.size = sizeof status;
  status.more.fill(0xFF);
  ASSERT_EQ(tandem_get_status(client, &status.known), TANDEM_OK);
  EXPECT_EQ(status.known.size, sizeof status) << "the stride of an array that is handed over again";
  EXPECT_NE(status.known.client_id, 0U);
  EXPECT_EQ(status.more, (std::array<std::uint8_t, 40>{}));
  EXPECT_EQ(tandem_leave(client), TANDEM_OK);
}

struct Grown {
  std::uint32_t size = sizeof(Grown);
  std::uint32_t first = 7, second = 8;
};

}  // namespace

template <>
inline constexpr std::size_t kFirstSize<Grown> = 8;

namespace {

TEST(Structs, OfAnOlderHeaderKeepTheDefaultsOfWhatTheyDoNotHave) {
  Grown theirs{8, 1, 2};
  Grown ours;
  ASSERT_EQ(read_struct(&theirs, ours), TANDEM_OK);
  EXPECT_EQ(ours.first, 1U);
  EXPECT_EQ(ours.second, 8U);
}

TEST(Structs, OfAnOlderHeaderAreWrittenToTheirEnd) {
  Grown theirs{8, 1, 2};
  write_struct(Grown{}, &theirs);
  EXPECT_EQ(theirs.size, 8U);
  EXPECT_EQ(theirs.first, 7U);
  EXPECT_EQ(theirs.second, 2U);
}

TEST(Structs, OfNoHeaderAreRefused) {
  Grown theirs;
  for (const std::uint32_t size : {0U, 3U, 7U, kLargestStruct + 1, UINT32_MAX}) {
    theirs.size = size;
    EXPECT_EQ(check_struct(&theirs), TANDEM_INVALID_ARGUMENT) << size;
  }
}

TEST(Structs, TextsAreCutBetweenCharacters) {
  char text[6];  // NOLINT(*-avoid-c-arrays): as in C's structs
  write_text("abc\xC3\xA4\xC3\xA4", text);
  EXPECT_STREQ(text, "abc\xC3\xA4");
  write_text("abcd\xC3\xA4", text);
  EXPECT_STREQ(text, "abcd");
  write_text("\x80\x80\x80\x80\x80\x80\x80", text);
  EXPECT_STREQ(text, "");
  write_text("", text);
  EXPECT_STREQ(text, "");
}

}  // namespace
}  // namespace tandem::api
