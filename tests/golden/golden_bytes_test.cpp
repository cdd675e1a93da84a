#include <gtest/gtest.h>

#include <string>

#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "tests/property/synthetic.hpp"

// Bytes of every codec on a small state. They change only with the protocol version.

namespace tandem {
namespace {

using Bytes = std::vector<std::byte>;

std::string to_text(std::span<const std::byte> bytes) {
  std::string text;
  for (const std::byte byte : bytes) {
    static constexpr char kDigits[] = "0123456789abcdef";
    text += kDigits[std::to_integer<unsigned>(byte) >> 4U];
    text += kDigits[std::to_integer<unsigned>(byte) & 15U];
  }
  return text;
}

// Hex with spaces wherever they help.
Bytes from_text(std::string_view text) {
  Bytes bytes;
  std::string digits;
  for (const char c : text) {
    if (c != ' ') digits += c;
  }
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
    bytes.push_back(static_cast<std::byte>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

constexpr StreamParameters kParameters{{100, 10, 20}};

// Twenty slots, of which 4 and 19 are dead.
State predicted() {
  State state(20);
  for (Slot slot = 0; slot < 19; ++slot) {
    if (slot != 4) state.spawn(slot, 0, 0, {{1000 * static_cast<std::int32_t>(slot), 0, -5}, {64, -64, 0}});
  }
  return state;
}

// Slots 3 and 7 are off: 3 by (150, 0, -2000) and v (0, 40, 0), 7 by (0, -130, 0).
State target() {
  State state = predicted();
  state.set_body(3, {{3150, 0, -2005}, {64, -24, 0}});
  state.set_body(7, {{7000, -130, -5}, {64, -64, 0}});
  return state;
}

// The parameters that a stream of `codec` has beside others.
StreamParameters parameters_of(std::string_view codec, const Groups& groups) {
  StreamParameters parameters = kParameters;
  if (!groups.orientation || !codec_traits(codec)->reads_steps) return parameters;
  parameters.codec.turn_step = 1 << 20;
  parameters.codec.spin_step = 1 << 16;
  return parameters;
}

// Encodes with `codec`, expects the bytes, and decodes these bytes to the same state.
void expect_bytes(std::string_view codec, std::string_view hex, const State& from, const State& to,
                  std::span<const LifecycleRecord> lifecycle = {}, const StreamParameters* changed = nullptr,
                  std::size_t budget = kNoBudget) {
  SCOPED_TRACE(codec);
  const Groups groups = from.groups();
  const StreamParameters parameters = parameters_of(codec, groups);
  DeltaCodec server = synthetic::make_delta(codec, from.capacity(), parameters, {}, groups);
  DeltaCodec client = synthetic::make_delta(codec, from.capacity(), parameters, {}, groups);
  if (changed != nullptr) server.set_parameters(*changed);
  Bytes out(server.bound());
  State agreed = from;
  out.resize(server.encode(agreed, to, lifecycle, budget, out).size_bytes);
  EXPECT_EQ(to_text(out), to_text(from_text(hex)));
  State held = from;
  const auto decoded = synthetic::receive(client, held, from_text(hex));
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(held, agreed);
}

TEST(GoldenBytes, OfNone) {
  State two(2);
  two.spawn(1, 0, 0, {{1, -1, 256}, {64, 0, -2}});
  State moved = two;
  moved.set_body(1, {{2, -1, 256}, {64, 0, -2}});
  expect_bytes("none", "83 1a 00 02 02000000 ffffffff 00010000 40000000 00000000 feffffff", two, moved);
}

TEST(GoldenBytes, OfSelective) {
  expect_bytes("selective",
               "83 35 00 01 880000"
               "4e0c0000 00000000 2bf8ffff 40000000 e8ffffff 00000000"
               "581b0000 7effffff fbffffff 40000000 c0ffffff 00000000",
               predicted(), target());
}

TEST(GoldenBytes, OfQuantized) {
  // -2000 is beyond 127 steps of 10.
  expect_bytes("quantized", "83 11 00 01 880000 0f0081 000200 00f300 000000", predicted(), target());
}

TEST(GoldenBytes, OfEntropy) {
  expect_bytes("entropy", "83 0d 00 01 880000 e51fee8603a80000", predicted(), target());
}

TEST(GoldenBytes, OfLimited) {  // One byte short of both bodies: the larger error goes.
  expect_bytes("limited", "83 0a 00 01 080000 e51fee8600", predicted(), target(), {}, nullptr, 14);
}

TEST(GoldenBytes, OfTracker) {  // Positions alone; v and c follow from them on both sides.
  expect_bytes("tracker", "86 2f2a01826b", predicted(), target());
}

// Slot 1 of two, turned by a quarter about z; then off by (50, 0, 0), five and three steps of a turn and
// seven of w.
State turning(bool more) {
  State state(2, synthetic::kTurning);
  BodyState body{{1, -1, 256}, {64, 0, -2}, {0, 0, 759250125, 759250125}, {1 << 20, 0, -5}};
  if (more) {
    body.p[0] += 50;
    body.q = turned(body.q, {0, 5 << 20, -3 << 20});
    body.w[1] = 7 << 16;
  }
  state.spawn(1, 0, 1, body);
  return state;
}

TEST(GoldenBytes, OfNoneWithOrientations) {
  expect_bytes("none",
               "83 36 00 02 33000000 ffffffff 00010000 40000000 00000000 feffffff"
               "77227100 77227100 fd9afc2c f45d842d 00001000 00000700 fbffffff",
               turning(false), turning(true));
}

TEST(GoldenBytes, OfEntropyWithOrientations) {
  // Residuals of 5, of none, of 0, 5, -3 (a step is 2^20) and of 0, 7, 0 (2^16).
  expect_bytes("entropy", "83 08 00 02 a80001581880", turning(false), turning(true));
}

TEST(GoldenBytes, OfLifecycleAndParameters) {
  State to = predicted();
  to.despawn(2);
  to.spawn(4, 9, 2, {{1, 2, 3}, {4, 5, 6}});
  to.set_body(5, {{-1, -2, -3}, {0, 0, 0}});
  to.type()[6] = 1;
  const std::vector<LifecycleRecord> records{{LifecycleKind::kDespawn, 2, 0, 0, {}},
                                             {LifecycleKind::kSpawn, 4, 9, 2, {{1, 2, 3}, {4, 5, 6}}},
                                             {LifecycleKind::kTeleport, 5, 0, 0, {{-1, -2, -3}, {0, 0, 0}}},
                                             {LifecycleKind::kTypeChange, 6, 0, 1, {}}};
  const StreamParameters changed{{200, 5, 7}};
  expect_bytes("quantized",
               "81 38"
               "08"
               "09 09 02 01000000 02000000 03000000 04000000 05000000 06000000"
               "06 01 ffffffff feffffff fdffffff 00000000 00000000 00000000"
               "07 01"
               "82 07 01 9003 02 0a 03 0e",
               predicted(), to, records, &changed);
}

TEST(GoldenBytes, ThatNoEncoderOfOursWritesAreDecodedToo) {
  // A list where the mask is shorter, a section of an unknown type that is not critical, and q = -128.
  DeltaCodec client = synthetic::make_delta("quantized", 20, kParameters);
  State state = predicted();
  const auto decoded =
      synthetic::receive(client, state,
                         from_text("07 03 aabbcc"
                                   "83 14 00 00 0200 0300 0700 800000 000000 000000 000001"));
  ASSERT_TRUE(decoded) << decoded.error().message;
  State expected = predicted();
  expected.p(0)[3] -= 1280;
  expected.v(2)[7] += 20;
  EXPECT_EQ(state, expected);
}

TEST(GoldenBytes, OfASnapshot) {
  Layout layout;
  layout.capacity = 9;
  layout.type_count = synthetic::kTypes;
  layout.codec = "quantized";
  layout.parameters = kParameters;
  layout.predictor = "ballistic";
  auto server = *ServerTimeline::create(layout, 0x0102);
  State state(9);
  state.spawn(1, 5, 0, {{-1, 100, 7}, {64, 0, 0}});
  state.spawn(8, 6, 2, {{2, 100, 8}, {64, 0, 0}});
  server.start(3, state, Drive{{0, -640, 0}, 10});
  ASSERT_TRUE(server.schedule({1, 5, Drive{{1, 2, 3}, 4}}));
  Bytes bytes;
  server.snapshot(bytes);
  const std::string_view golden =
      "54445350 03 0201000000000000 00000000 00000000 0300000000000000 0100000000000000"
      "00000000 80fdffff 00000000 0a00"
      "933a3916bebd5cc5 09000000"
      "82 11 01 c801 02 14 03 28 04 00 05 cc9903 06 cc9901"
      "84 1e 0100000000000000 0500000000000000 01000000 02000000 03000000 0400"
      "85 1c 40e3ab95e48141ca"
      "9d7dc39ab122c0dfbf6a93982517b6541690b00c";
  EXPECT_EQ(to_text(bytes), to_text(from_text(golden)));
  auto client = *ClientTimeline::create(layout);
  const auto loaded = client.load(from_text(golden), 0x0102);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(client.state(3), state);
}

TEST(GoldenBytes, OfTheDefaultCodeTables) {
  EXPECT_EQ(to_hex(hash_bytes(default_code_tables())), "fe41058991578c63");
}

}  // namespace
}  // namespace tandem
