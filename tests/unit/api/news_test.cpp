// Keys and events of a session, as an application reads them.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "sdk/client/api/news_queue.hpp"
#include "tests/support/playground/playground.hpp"

namespace tandem::api::of_news {
namespace {

std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

class NewsOfASession : public ::testing::Test {
 protected:
  NewsOfASession() : client(playground.join()) {
    EXPECT_EQ(tandem_wait_until_playing(client, 10), TANDEM_OK) << tandem_error_text();
  }
  ~NewsOfASession() override { EXPECT_EQ(tandem_leave(client), TANDEM_OK); }
  NewsOfASession(const NewsOfASession&) = delete;
  NewsOfASession& operator=(const NewsOfASession&) = delete;
  NewsOfASession(NewsOfASession&&) = delete;
  NewsOfASession& operator=(NewsOfASession&&) = delete;

  void run(double seconds) const {
    for (const std::int64_t end_ns = Playground::now().steady_ns + static_cast<std::int64_t>(seconds * 1e9);
         Playground::now().steady_ns < end_ns;)
      ASSERT_EQ(tandem_update(client, 0.01), TANDEM_OK) << tandem_error_text();
  }
  [[nodiscard]] std::vector<tandem_news> take() const {
    std::vector<tandem_news> all;
    for (tandem_news news = TANDEM_NEWS_INIT; tandem_next_news(client, &news) == TANDEM_OK;)
      all.push_back(news);
    return all;
  }

  Playground playground;
  tandem_client client;
};

TEST_F(NewsOfASession, AnEventHasItsKindItsBodyItsBytesAndItsFrame) {
  ASSERT_TRUE(playground.news().broadcast(7, bytes("goal"), 3));
  ASSERT_TRUE(playground.news().broadcast(8, {}, {}));
  run(0.5);
  const auto news = take();
  ASSERT_EQ(news.size(), 2U);
  EXPECT_EQ(news[0].what, TANDEM_NEWS_EVENT);
  EXPECT_EQ(news[0].kind, 7U);
  EXPECT_EQ(news[0].number, 1U);
  EXPECT_EQ(news[0].has_body, 1U);
  EXPECT_EQ(news[0].slot, 3U);
  EXPECT_EQ(news[0].byte_count, 4U);
  EXPECT_EQ(std::memcmp(news[0].bytes, "goal", 4), 0);
  EXPECT_GT(news[0].frame, 0U);
  EXPECT_EQ(news[1].has_body, 0U);
  EXPECT_EQ(news[1].frame, news[0].frame);
  EXPECT_NE(news[0].epoch, 0U);
  tandem_news none = TANDEM_NEWS_INIT;
  EXPECT_EQ(tandem_next_news(client, &none), TANDEM_NOT_READY);
}

TEST_F(NewsOfASession, KeysAreReadByNameAndListed) {
  ASSERT_TRUE(playground.news().set_key("score", bytes("12:7")));
  ASSERT_TRUE(playground.news().set_key("phase", bytes("")));
  run(0.5);
  const auto news = take();
  ASSERT_EQ(news.size(), 2U);
  EXPECT_EQ(news[0].what, TANDEM_NEWS_KEY);
  EXPECT_STREQ(news[0].key, "phase");
  EXPECT_STREQ(news[1].key, "score");
  EXPECT_EQ(news[1].byte_count, 4U);
  std::array<char, TANDEM_KEY_SIZE> name{};
  ASSERT_EQ(tandem_get_key_name(client, 1, name.data(), name.size()), TANDEM_OK);
  EXPECT_STREQ(name.data(), "score");
  EXPECT_EQ(tandem_get_key_name(client, 2, name.data(), name.size()), TANDEM_NOT_READY);
  std::array<char, 4> value{};
  std::size_t count = 0;
  ASSERT_EQ(tandem_get_key(client, "score", value.data(), value.size(), &count), TANDEM_OK);
  EXPECT_EQ(std::memcmp(value.data(), "12:7", 4), 0);
  EXPECT_EQ(tandem_get_key(client, "score", value.data(), 2, &count), TANDEM_CAPACITY);
  EXPECT_EQ(count, 4U);
  EXPECT_EQ(tandem_get_key(client, "score", nullptr, 0, &count), TANDEM_OK);
  EXPECT_EQ(tandem_get_key(client, "Score", nullptr, 0, &count), TANDEM_NOT_READY);
  ASSERT_TRUE(playground.news().remove_key("score"));
  run(0.5);
  ASSERT_EQ(take().at(0).gone, 1U);
  EXPECT_EQ(tandem_get_key(client, "score", nullptr, 0, &count), TANDEM_NOT_READY);
}

TEST_F(NewsOfASession, BadArgumentsAreRefused) {
  std::size_t count = 0;
  char name = 0;
  EXPECT_EQ(tandem_next_news(client, nullptr), TANDEM_INVALID_ARGUMENT);
  tandem_news news{};
  EXPECT_EQ(tandem_next_news(client, &news), TANDEM_INVALID_ARGUMENT);  // without its size
  EXPECT_EQ(tandem_get_key(client, nullptr, nullptr, 0, &count), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_key(client, "a", nullptr, 1, &count), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_key_name(client, 0, nullptr, 1), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_key_name(client, 0, &name, 0), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_key(client + 1, "a", nullptr, 0, &count), TANDEM_INVALID_HANDLE);
}

TEST(AQueueOfNews, NamesTheEventsThatItDroppedAsLost) {
  NewsQueue queue;
  for (std::uint64_t i = 1; i <= NewsQueue::kMaxNews + 10; ++i) {
    QueuedNews news;
    news.what = i % 2 == 0 ? TANDEM_NEWS_KEY : TANDEM_NEWS_EVENT;
    news.frame = news.number = i;
    queue.add(news);
  }
  const auto lost = queue.take();
  ASSERT_TRUE(lost);
  EXPECT_EQ(lost->what, TANDEM_NEWS_LOST);
  EXPECT_EQ(lost->number, 5U);
  EXPECT_EQ(lost->frame, 10U);
  EXPECT_EQ(queue.take()->number, 11U);
}

TEST(AQueueOfNews, HoldsAMebibyteAtMost) {
  NewsQueue queue;
  for (int i = 0; i < 1100; ++i) {
    QueuedNews news;
    news.what = TANDEM_NEWS_EVENT;
    news.bytes.resize(1024);
    queue.add(news);
  }
  EXPECT_EQ(queue.take()->number, 1100U - 1024U);
}

}  // namespace
}  // namespace tandem::api::of_news
