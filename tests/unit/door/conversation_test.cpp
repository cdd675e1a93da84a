// Tests the order of messages: one question, one answer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "services/engines/door/conversation.hpp"

namespace tandem::engine::door {
namespace {

using ::testing::HasSubstr;
using State = Conversation::State;

constexpr std::string_view kHello = "engine 1.0\ncapacity 5\ndt 0.1\n";

std::vector<std::byte> done(std::uint64_t frame, std::uint32_t slot = 0) {
  std::vector<std::byte> body(kDoneBytes);
  std::memcpy(body.data(), &frame, 8);
  std::memcpy(body.data() + 8, &slot, 4);
  return body;
}

class ConversationTest : public ::testing::Test {
 protected:
  std::string take(Type type, std::span<const std::byte> body = {}) {
    const auto taken = talk.take(type, body);
    return taken ? "" : taken.error().message;
  }
  void started() {
    ASSERT_EQ(take(Type::kHello, std::as_bytes(std::span(kHello))), "");
    ASSERT_EQ(take(Type::kStart), "");
  }
  Conversation talk;
};

TEST_F(ConversationTest, GoesFromHelloToFrames) {
  started();
  talk.ask_step(1);
  EXPECT_EQ(talk.where(), "in frame 1");
  EXPECT_EQ(take(Type::kDone, done(1)), "");
  EXPECT_EQ(talk.state(), State::kIdle);
}

TEST_F(ConversationTest, NewsComeWithinAStepAloneAndLastUntilTheNextQuestion) {
  constexpr std::string_view hello = "engine 1.2\ncapacity 5\ndt 0.1\nnews keys\n";
  const auto news = [](std::uint64_t frame) {
    std::vector<std::byte> body(kNewsBytes + 16 + 2);
    const std::array<std::uint32_t, 4> head{3, 0, 0, 2};
    std::memcpy(body.data(), &frame, 8);
    std::memcpy(body.data() + 8, head.data(), sizeof head);
    return body;
  };
  ASSERT_EQ(take(Type::kHello, std::as_bytes(std::span(hello))), "");
  ASSERT_EQ(take(Type::kStart), "");
  talk.ask_step(1);
  EXPECT_EQ(take(Type::kNews, news(1)), "");
  EXPECT_EQ(talk.state(), State::kStep);
  EXPECT_EQ(take(Type::kNews, news(1)), "");
  EXPECT_EQ(take(Type::kDone, done(1)), "");
  EXPECT_EQ(talk.news().size(), 2U * 18);
  talk.ask_step(2);
  EXPECT_TRUE(talk.news().empty());
  EXPECT_EQ(take(Type::kDone, done(2)), "");
  EXPECT_EQ(take(Type::kNews, news(2)), "the engine sent NEWS unasked after frame 2");
  talk = {};
  EXPECT_EQ(take(Type::kNews, news(0)), "the engine sent NEWS instead of HELLO before HELLO");
}

TEST_F(ConversationTest, WhatComesUnaskedEndsIt) {
  started();
  talk.ask_step(1);
  ASSERT_EQ(take(Type::kDone, done(1)), "");
  EXPECT_EQ(take(Type::kDone, done(1)), "the engine sent DONE unasked after frame 1");
  EXPECT_EQ(talk.state(), State::kOver);
  EXPECT_NE(take(Type::kHello), "");
}

TEST_F(ConversationTest, WrongAnswersAreNamedWithTheFrame) {
  EXPECT_EQ(take(Type::kStart), "the engine sent START instead of HELLO before HELLO");
  talk = {};
  started();
  talk.ask_step(12);
  EXPECT_EQ(take(Type::kDone, done(11)), "the engine's DONE is of frame 11 in frame 12");
  talk = {};
  started();
  talk.ask_step(12);
  EXPECT_THAT(take(Type::kDone, done(12, 4)), HasSubstr("slot 4"));
  talk = {};
  started();
  talk.ask_step(12);
  EXPECT_EQ(take(Type::kSaved), "the engine sent SAVED instead of DONE in frame 12");
}

TEST_F(ConversationTest, TheEnginesWordsArePlainText) {
  started();
  talk.ask_step(3);
  constexpr std::string_view kWords = "it\x1b[31m broke\n";
  EXPECT_EQ(take(Type::kError, std::as_bytes(std::span(kWords))),
            "the engine gave up in frame 3: it?[31m broke");
}

TEST_F(ConversationTest, TheInlineFormBringsASlotWithItsAnswers) {
  constexpr std::string_view hello = "engine 1.0\ncapacity 5\ndt 0.1\nmemory inline\n";
  ASSERT_EQ(take(Type::kHello, std::as_bytes(std::span(hello))), "");
  std::vector<std::byte> slot(talk.layout().slot_bytes);
  EXPECT_THAT(take(Type::kStart, std::span(slot).first(5)), HasSubstr("fewer than"));
  talk = {};
  ASSERT_EQ(take(Type::kHello, std::as_bytes(std::span(hello))), "");
  EXPECT_EQ(take(Type::kStart, slot), "");
  EXPECT_EQ(talk.slot().size(), slot.size());
}

}  // namespace
}  // namespace tandem::engine::door
