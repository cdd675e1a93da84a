#pragma once
// Makes pictures of one epoch's timeline for sampling.

#include <cstdint>
#include <vector>

#include "sdk/client/drawing/picture.hpp"
#include "sdk/client/drawing/server_clock.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/messages.hpp"

namespace tandem::client {

/// Follows a timeline and shows what is new in it. It costs nothing until there is a reader. From then on it
/// copies what is drawn, once for each frame that is applied or simulated ahead. If memory runs out, the
/// previous picture stays. Not thread-safe.
class PictureWriter {
 public:
  /// `exchange` must outlive it.
  PictureWriter(PictureExchange& exchange, const transport::SessionMessage& session);

  /// Draws `state` as the agreed state from the next frame on; it must be of that frame. Null: the timeline's
  /// state.
  void draw_instead(const State* state) {
    instead_ = state;
    accelerations_.forget(jumps_.size());
  }

  /// Call when the first reader samples, for the snapshot that is held, and then after each snapshot that is
  /// loaded.
  void on_loaded(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns);
  /// Call after ClientTimeline::apply().
  void on_applied(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns);
  /// Call when another timeline of the same session takes over at the same frame; differences between the two
  /// are blended in.
  void on_changed(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns);
  /// Call when frames beyond the agreed one were simulated, or simulated again.
  void on_simulated(const ClientTimeline& timeline, const Pacer& pacer);
  /// Shows the echo from the next on_clock() on.
  void on_echo(const std::optional<GravityEcho>& echo) { picture_.echo = echo; }
  /// Call when the estimate of the server's clock may have changed.
  void on_clock(const Pacer& pacer);

 private:
  // `next` is the picture that is being made.
  [[nodiscard]] const DrawnFrame* draw(const State& state, Frame frame, const Picture& next);
  void show_agreed(Picture& next, const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns);
  void draw_ahead(const ClientTimeline& timeline, Picture& next);
  void show(const Picture& next, const Pacer& pacer);
  /// False until the first picture was made, because there is nothing to follow before.
  [[nodiscard]] bool follows() const { return picture_.agreed != nullptr; }

  PictureExchange& exchange_;
  Picture picture_;
  const State* instead_ = nullptr;
  bool is_loaded_anew_ = false;  // the picture is still of the time before the last snapshot
  std::vector<std::uint8_t> jumps_;
  Accelerations accelerations_;
};

}  // namespace tandem::client
