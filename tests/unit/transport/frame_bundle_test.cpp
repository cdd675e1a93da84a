#include "sdk/wire/frame_bundle.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace tandem::transport {
namespace {

Bytes bytes(std::size_t count, int value) { return {count, static_cast<std::byte>(value)}; }

std::string text_of(const DeltaMessage& delta) {
  std::string text;
  for (const FrameRun& run : read_frames(delta))
    text += std::to_string(run.last - run.before) + "-" + std::to_string(run.last) + "#" +
            std::to_string(run.hash) + ":" + std::to_string(run.payload.size()) + " ";
  return text;
}

TEST(FrameBundle, AFrameByItselfIsItsPayload) {
  FrameBundle bundle;
  bundle.add(7, 70, bytes(3, 1));
  const DeltaMessage delta = bundle.take();
  EXPECT_EQ(delta.frame, 7U);
  EXPECT_EQ(delta.earlier, 0U);
  EXPECT_EQ(delta.payload, bytes(3, 1));
  EXPECT_EQ(text_of(delta), "7-7#70:3 ");
  EXPECT_TRUE(bundle.empty());
}

TEST(FrameBundle, FramesInWhichNothingChangedTakeNoBytes) {
  FrameBundle bundle;
  for (Frame frame = 5; frame <= 64; ++frame) bundle.add(frame, 9, {});
  const DeltaMessage delta = bundle.take();
  EXPECT_EQ(delta.earlier, 59U);
  EXPECT_TRUE(delta.payload.empty());
  EXPECT_EQ(text_of(delta), "5-64#9:0 ");
}

TEST(FrameBundle, TellsEachFrameItsHashAndPayload) {
  FrameBundle bundle;
  bundle.add(10, 1, bytes(200, 1));
  bundle.add(11, 2, {});
  bundle.add(12, 2, {});
  bundle.add(13, 3, {});
  bundle.add(14, 0xFFFF'FFFF'FFFF'FFFF, bytes(1, 4));
  bundle.add(15, 5, {});
  EXPECT_EQ(bundle.frames(), 6U);
  const std::size_t most = bundle.bytes_with(100);
  DeltaMessage delta = bundle.take();
  EXPECT_LE(delta.payload.size() + 100, most);
  EXPECT_EQ(text_of(delta), "10-10#1:200 11-12#2:0 13-13#3:0 14-14#18446744073709551615:1 15-15#5:0 ");
  EXPECT_EQ(read_frames(delta)[0].payload.front(), std::byte{1});
  EXPECT_EQ(read_frames(delta)[3].payload.front(), std::byte{4});
}

// The example of idl/PROTOCOL.md.
TEST(FrameBundle, HasTheDocumentedBytes) {
  FrameBundle bundle;
  bundle.add(100, 1, bytes(1, 0x41));
  bundle.add(101, 1, {});
  bundle.add(102, 1, {});
  bundle.add(103, 4, bytes(1, 0x42));
  const DeltaMessage delta = bundle.take();
  Bytes expected;
  for (const int value : {0x02, 0x41, 1, 0, 0, 0, 0, 0, 0, 0, 0x05, 1, 0, 0, 0, 0, 0, 0, 0, 0x02, 0x42})
    expected.push_back(static_cast<std::byte>(value));
  EXPECT_EQ(delta.payload, expected);
  EXPECT_EQ(delta.hash, 4U);
  EXPECT_EQ(delta.earlier, 3U);
}

TEST(FrameBundle, WhatBreaksTheFormatTellsNothing) {
  FrameBundle bundle;
  bundle.add(10, 1, bytes(2, 1));
  bundle.add(11, 2, {});
  bundle.add(12, 3, bytes(1, 4));
  const DeltaMessage good = bundle.take();
  ASSERT_EQ(read_frames(good).size(), 3U);
  for (std::size_t size = 1; size < good.payload.size(); ++size) {
    DeltaMessage cut = good;
    cut.payload.resize(size);
    EXPECT_TRUE(read_frames(cut).empty()) << size;
  }
  const auto with = [&good](auto&& change) {
    DeltaMessage delta = good;
    change(delta);
    return read_frames(delta).size();
  };
  EXPECT_EQ(with([](DeltaMessage& d) { d.payload.push_back({}); }), 0U) << "more behind the last frame";
  EXPECT_EQ(with([](DeltaMessage& d) { d.earlier = 3; }), 0U) << "fewer frames than it says";
  EXPECT_EQ(with([](DeltaMessage& d) { d.earlier = 1; }), 0U) << "more frames than it says";
  EXPECT_EQ(with([](DeltaMessage& d) { d.payload[0] = std::byte{0}; }), 0U) << "a payload of no bytes";
  EXPECT_EQ(with([](DeltaMessage& d) { d.payload[0] = std::byte{1}; }), 0U) << "no quiet frames";
  EXPECT_EQ(with([](DeltaMessage& d) { d.parts = 2; }), 0U);
  EXPECT_EQ(with([](DeltaMessage& d) { d.frame = 2; }), 0U) << "frame 0 has no delta";
}

}  // namespace
}  // namespace tandem::transport
