#pragma once
// A queue of what a session told beside bodies, which the application empties when it likes.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "sdk/client/session/told_news.hpp"
#include "tandem/tandem.h"

namespace tandem::api {

/// One entry. See tandem_news.
struct QueuedNews {
  tandem_news_kind what = 0;
  Epoch epoch = 0;
  Frame frame = 0;
  std::uint64_t number = 0;
  std::uint32_t kind = 0;
  std::optional<WorldEvent::Body> body = {};
  bool gone = false;
  std::size_t value_size = 0;
  std::string key = {};
  std::vector<std::byte> bytes = {};
};

/// Bounded: beyond that the oldest entries are dropped, and their events named as lost. Not thread-safe.
class NewsQueue {
 public:
  static constexpr std::size_t kMaxNews = 4096, kMaxBytes = 1U << 20U;

  void add(QueuedNews news);
  [[nodiscard]] std::optional<QueuedNews> take();

 private:
  std::deque<QueuedNews> queue_;
  std::size_t bytes_ = 0;
  QueuedNews dropped_;  // number: events; frame and epoch: of the last entry
};

}  // namespace tandem::api
