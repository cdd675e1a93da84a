#pragma once
// The sessions on a domain, with what is needed to choose one. A tandem_browser is a handle of a Browser.

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "sdk/transport/dds/dds_ports.hpp"

namespace tandem::api {

struct FoundSession {
  transport::SessionMessage announced;
  /// The stream that a client would play; null if none can be played.
  const transport::StreamMessage* stream = nullptr;
  /// The status of this epoch's first stream that was heard of, with the clients of all; or empty.
  transport::ServerStatusMessage status;
};

/// Keeps the last messages of each live session. Thread-safe.
class Browser {
 public:
  explicit Browser(std::unique_ptr<transport::Monitor> monitor) : monitor_(std::move(monitor)) {}

  /// Takes what arrived and calls `see(found)` for each live session, sorted by name. If several servers have
  /// one name, it shows the one that was seen first, because clients follow that one.
  template <class See>
  void list(std::int64_t now_ns, See&& see) {
    const std::lock_guard lock(mutex_);
    refresh(now_ns);
    for (const auto& [name, found] : sessions_) see(found);
  }

 private:
  struct Heard {
    transport::ServerStatusMessage status;
    std::int64_t at_ns = 0;
  };
  using Run = std::pair<transport::ParticipantId, Epoch>;
  static constexpr std::size_t kNone = SIZE_MAX;

  void refresh(std::int64_t now_ns);
  void hear(std::int64_t now_ns);
  [[nodiscard]] transport::ServerStatusMessage status_of(const transport::SessionMessage& session) const;
  [[nodiscard]] std::size_t playable_stream(const transport::Received<transport::SessionMessage>& announced);

  std::mutex mutex_;
  std::unique_ptr<transport::Monitor> monitor_;
  std::map<std::string, FoundSession> sessions_;
  std::map<std::pair<std::string, std::uint32_t>, Heard> heard_;  // by session and stream
  /// The first stream of each live session that can be played. Kept, because finding out takes time.
  std::map<Run, std::size_t> playable_;
};

}  // namespace tandem::api
