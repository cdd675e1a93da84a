#pragma once
// What the application was told of a session's keys and events.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "sdk/core/timeline/timeline.hpp"

namespace tandem::client {

/// Something that happened, as the application is told. `event` points to what is valid during the call.
struct Happened {
  Epoch epoch = 0;
  Frame frame = 0;
  std::uint64_t number = 0;  ///< 1, 2, ... over epochs that continue each other
  WorldEvent event;
};

/// Is told of news. It must not call the client.
class NewsListener {
 public:
  virtual ~NewsListener() = default;
  /// Once for each event, in their order, when its frame is applied.
  virtual void on_happened(const Happened& /*event*/) {}
  /// So many events happened of which the client never heard, up to `frame`.
  virtual void on_events_lost(Epoch /*epoch*/, Frame /*frame*/, std::uint64_t /*count*/) {}
  /// So many that were told, of frames beyond `frame`, did not happen: the epoch goes on from there.
  virtual void on_events_taken_back(Epoch /*epoch*/, Frame /*frame*/, std::uint64_t /*count*/) {}
  /// A key has another value than the application was told, or is gone.
  virtual void on_key(Epoch /*epoch*/, Frame /*frame*/, const KeyChange& /*change*/) {}
};

/// Tells each event once, over joins, changes of the stream and epochs that share a history: idl/STATES.md,
/// "Events". Bounded. Not thread-safe.
class ToldNews {
 public:
  /// Frames with events that are remembered, in case another epoch does not share them.
  static constexpr std::size_t kMaxMarks = 1024;
  /// Of the frames of a stream that the client is about to change to.
  static constexpr std::size_t kMaxKeptBytes = 1U << 20U;

  explicit ToldNews(NewsListener& listener) : listener_(&listener) {}

  /// Another epoch is followed; `shared`: up to that frame its history is that of the one before.
  void enter(Epoch epoch, std::optional<Frame> shared);
  /// The stream that is played was loaded from a snapshot.
  void on_loaded(const ClientTimeline& timeline);
  /// It applied a frame.
  void on_applied(const ClientTimeline& timeline);
  /// The stream that the client changes to applied a frame, perhaps ahead of the one that is played.
  void keep(const ClientTimeline& other);
  /// That stream is played now.
  void move_over(const ClientTimeline& other);
  /// It will not be.
  void forget_kept();

  [[nodiscard]] const SessionWorld::Keys& keys() const { return keys_; }

 private:
  struct Mark {
    Frame frame = 0;
    std::uint64_t before = 0, after = 0;  // events up to the frame
  };
  struct Kept {
    Mark mark;
    std::vector<WorldEvent> events;
    std::vector<std::byte> bytes;  // that they point to
  };

  void tell(const Mark& mark, const std::vector<WorldEvent>& events);
  void tell_lost(Frame frame, std::uint64_t count);
  void tell_keys(Frame frame, const News& news);
  void tell_all_keys(Frame frame, const SessionWorld::Keys& now);

  NewsListener* listener_;
  Epoch epoch_ = 0;
  bool joined_ = false;      // frame_ and count_ are of this history
  Frame frame_ = 0;          // the last whose events were told
  std::uint64_t count_ = 0;  // of all events up to it
  std::deque<Mark> marks_;   // ascending
  std::deque<Kept> kept_;    // ascending
  std::size_t kept_bytes_ = 0;
  SessionWorld::Keys keys_;
  bool keys_are_old_ = false;  // they may differ from the world's at frame_
};

}  // namespace tandem::client
