// Tests what lines and messages say, and how a wrong one is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "services/engines/door/wire.hpp"
#include "tandem/engine.h"

namespace tandem::engine::door {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

static_assert(static_cast<int>(Type::kHello) == TANDEM_ENGINE_HELLO &&
              static_cast<int>(Type::kBye) == TANDEM_ENGINE_BYE &&
              static_cast<int>(Type::kNews) == TANDEM_ENGINE_NEWS);
static_assert(static_cast<int>(Type::kDone) == TANDEM_ENGINE_DONE && kMaxBodyBytes == TANDEM_ENGINE_BODY);

std::string why(std::string_view lines) {
  const auto hello = parse_hello(lines);
  return hello ? "" : hello.error().message;
}

TEST(Hello, SaysWhatAnEngineIs) {
  const auto hello = parse_hello(
      "engine 1.3\nname pile\r\n capacity  17\ndt 0.04\nup z\nturns 1\nfloat 64\nsave 1\nmemory inline\n"
      "gravity 0 0 -9.81\ndamping 0.1\nstep_limit 2.5\ninput gravity 50\ninput push 10\ninput application 8\n"
      "type grain 0.5 FF8000FF 2 box 1 2 3\nplane 0 0 1 -2\nbox 1 2 3 4 5 6\nball 0 0 0 2\n"
      "law 1 2 3 4 5 6 2\nsome_later_key 1 2\n\n");
  ASSERT_TRUE(hello.has_value()) << hello.error().message;
  EXPECT_EQ(hello->capacity, 17U);
  EXPECT_EQ(hello->up_axis, 2U);
  EXPECT_TRUE(hello->turns && hello->doubles && hello->saves && hello->in_line && hello->has_law);
  EXPECT_EQ(hello->gravity[2], -9.81);
  EXPECT_EQ(hello->most_push, 10);
  ASSERT_EQ(hello->types.size(), 1U);
  EXPECT_EQ(hello->types[0].colour_rgba, 0xFF8000FFU);
  EXPECT_EQ(hello->types[0].shape, BodyShape::kBox);
  EXPECT_EQ(hello->scenery.boxes[0].half[2], 6);
  const auto again = parse_hello(print_hello(*hello));
  ASSERT_TRUE(again.has_value()) << again.error().message;
  EXPECT_EQ(print_hello(*again), print_hello(*hello));
}

TEST(Hello, SaysWhatItTellsAndLayoutAnswersWhatTheServerKnows) {
  const auto tells = [](const std::string& line) {
    return parse_hello("engine 1.2\ncapacity 1\ndt 0.1\n" + line + "\n");
  };
  const auto both = tells("news events weather keys");
  ASSERT_TRUE(both.has_value()) << both.error().message;
  EXPECT_TRUE(both->tells.keys && both->tells.events);
  EXPECT_THAT(print_layout(layout_of(*both), ""), HasSubstr("\nnews keys events\n"));
  EXPECT_THAT(print_hello(*both), HasSubstr("\nnews keys events\n"));
  const auto one = tells("news events");
  EXPECT_TRUE(one && !one->tells.keys && one->tells.events);
  EXPECT_THAT(print_layout(layout_of(*tells("")), ""), Not(HasSubstr("news")));
  EXPECT_THAT(why("engine 1.2\nnews\n"), HasSubstr("`news`: takes 1 to 8 values"));
}

TEST(Hello, NamesLinesOfUnknownKeys) {
  const auto hello = parse_hello("engine 1.0\ncapacity 1\ndt 0.1\npalne 0 1 0 0\n");
  ASSERT_TRUE(hello.has_value()) << hello.error().message;
  EXPECT_THAT(hello->ignored, ElementsAre("palne 0 1 0 0"));
}

TEST(Hello, IsRefusedWithItsLineInTheCallersWords) {
  EXPECT_THAT(why(""), HasSubstr("empty"));
  EXPECT_THAT(why("name x\n"), HasSubstr("does not begin"));
  EXPECT_THAT(why("engine 2.0\n"), HasSubstr("version 2.0"));
  EXPECT_THAT(why("engine one\n"), HasSubstr("'one' is not a version"));
  EXPECT_THAT(why("engine 1.0\n"), HasSubstr("says no capacity"));
  EXPECT_THAT(why("engine 1.0\ncapacity 5\n"), HasSubstr("says no dt"));
  EXPECT_THAT(
      why("engine 1.0\ncapacity 5000000\n"),
      StartsWith("the engine's line `capacity 5000000`: '5000000' is not a whole number of 1 to 4194304"));
  EXPECT_THAT(why("engine 1.0\ncapacity -1\n"), HasSubstr("capacity"));
  EXPECT_THAT(why("engine 1.0\ncapacity 5\ndt nan\n"), StartsWith("the engine's line `dt nan`: 'nan'"));
  EXPECT_THAT(why("engine 1.0\ntype a 1 blue\n"), HasSubstr("colour"));
  EXPECT_THAT(why("engine 1.0\ntype my crate 1\n"),
              HasSubstr("`type my crate 1`: radius 'crate' is not a number"));
  EXPECT_THAT(why("engine 1.0\ntype a 1 FFFFFFFF -2\n"), HasSubstr("mass '-2' is not"));
  EXPECT_THAT(why("engine 1.0\ntype a 1 FFFFFFFF 1 box 1 2\n"), HasSubstr("a box has 3 shape values, not 2"));
  EXPECT_THAT(why("engine 1.0\ntype a 1 FFFFFFFF 1 hull 1 2 3\n"),
              HasSubstr("four or more points x y z, not 3"));
  EXPECT_THAT(why("engine 1.0\ntype a 1 FFFFFFFF 1 cube\n"), HasSubstr("no shape 'cube': sphere, box,"));
  EXPECT_THAT(why("engine 1.0\nplane 0 0 3 1\n"),
              HasSubstr("`plane 0 0 3 1`: the normal has length 3, not 1"));
  EXPECT_THAT(why("engine 1.0\ntoken 0123456789abcdef and more\n"), Not(HasSubstr("0123456789abcdef")));
  EXPECT_THAT(why("engine 1.0\nfloat 16\n"), HasSubstr("float"));
  EXPECT_THAT(why("engine 1.0\nname \x01\n"), HasSubstr("name"));
}

TEST(LayoutOfAnOddCapacity, PadsAxesAndAligns) {
  Hello hello;
  hello.capacity = 17;
  hello.turns = true;
  const Layout layout = layout_of(hello);
  EXPECT_EQ(layout.padded, 32U);
  EXPECT_EQ(layout.column("position").offset, 64U);
  EXPECT_EQ(layout.column("velocity").offset, 64U + 3 * 4 * 32);
  EXPECT_EQ(layout.slot_bytes % 4096, 0U);
  EXPECT_EQ(
      print_layout(layout, "/proc/1/fd/3"),
      "layout 1.2\nmemory shared\npath /proc/1/fd/3\nbytes 8192\ncapacity 17\npadded 32\nslots 1\nfirst 4096\n"
      "slot_bytes 4096\ncolumn position f32 3 64\ncolumn velocity f32 3 448\ncolumn orientation f32 4 832\n"
      "column angular_velocity f32 3 1344\ncolumn alive u8 1 1728\ncolumn type u16 1 1792\n");
}

TEST(Messages, HaveTheseBytes) {
  std::vector<std::byte> out;
  append_step(out, 0x0102, 3);
  const std::vector<unsigned char> step{5, 0, 0, 0, 16, 0, 0, 0, 2, 1, 0, 0,
                                        0, 0, 0, 0, 3,  0, 0, 0, 0, 0, 0, 0};
  EXPECT_TRUE(std::equal(out.begin(), out.end(), step.begin(), step.end(), [](std::byte a, unsigned char b) {
    return std::to_integer<unsigned char>(a) == b;
  }));
  out.clear();
  append_input(out, 9, {.kind = 16, .bytes = {std::byte{7}}});
  EXPECT_EQ(out.size(), kHeadBytes + 16 + 1);
  out.clear();
  append_input(out, 9, {.kind = 1, .values = {1, 2, 3}});
  EXPECT_EQ(out.size(), kHeadBytes + 16 + 24);
}

TEST(ReaderTest, CutsAnyPiecesIntoMessages) {
  std::vector<std::byte> bytes;
  append(bytes, Type::kStart, std::string_view());
  append(bytes, Type::kError, std::string_view("hello"));
  append(bytes, Type::kBye, std::string_view());
  for (std::size_t piece = 1; piece < 9; ++piece) {
    Reader reader;
    std::vector<std::pair<Type, std::size_t>> seen;
    for (std::size_t at = 0;;) {
      const auto room = reader.room();
      ASSERT_TRUE(room.has_value());
      const std::size_t count = std::min({room->size(), piece, bytes.size() - at});
      std::memcpy(room->data(), bytes.data() + at, count);
      reader.filled(count);
      at += count;
      if (const auto message = reader.take()) seen.emplace_back(message->type, message->body.size());
      if (at == bytes.size() && seen.size() == 3) break;
    }
    EXPECT_THAT(seen, ::testing::ElementsAre(std::pair(Type::kStart, 0U), std::pair(Type::kError, 5U),
                                             std::pair(Type::kBye, 0U)));
  }
}

TEST(ReaderTest, RefusesLengthsBeyondTheLimitBeforeItTakesMemory) {
  Reader reader;
  const std::array<std::uint32_t, 2> head{6, 0x7FFFFFFF};
  std::memcpy(reader.room()->data(), head.data(), sizeof head);
  reader.filled(sizeof head);
  const auto room = reader.room();
  ASSERT_FALSE(room.has_value());
  EXPECT_THAT(room.error().message, HasSubstr("DONE has 2147483647 bytes"));
}

}  // namespace
}  // namespace tandem::engine::door
