#include "sdk/client/api/news_queue.hpp"

#include <utility>

namespace tandem::api {

void NewsQueue::add(QueuedNews news) {
  bytes_ += news.bytes.size();
  queue_.push_back(std::move(news));
  while (queue_.size() > kMaxNews || bytes_ > kMaxBytes) {
    const QueuedNews& oldest = queue_.front();
    bytes_ -= oldest.bytes.size();
    if (oldest.what == TANDEM_NEWS_EVENT) ++dropped_.number;
    if (oldest.what == TANDEM_NEWS_LOST) dropped_.number += oldest.number;
    dropped_.what = TANDEM_NEWS_LOST;
    dropped_.epoch = oldest.epoch;
    dropped_.frame = oldest.frame;
    queue_.pop_front();
  }
}

std::optional<QueuedNews> NewsQueue::take() {
  if (dropped_.what != 0) return std::exchange(dropped_, {});
  if (queue_.empty()) return std::nullopt;
  QueuedNews news = std::move(queue_.front());
  queue_.pop_front();
  bytes_ -= news.bytes.size();
  return news;
}

}  // namespace tandem::api
