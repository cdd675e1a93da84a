#pragma once
// Pictures of one epoch's timeline, for sampling.

#include <cstdint>
#include <vector>

#include "sdk/client/drawing/picture.hpp"
#include "sdk/client/drawing/server_clock.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/transport/messages.hpp"

namespace tandem::client {

/// Follows a timeline and shows what is new of it. Costs nothing until somebody samples; from then on a copy
/// of what is drawn for each frame that is applied or simulated ahead. Where memory runs out, the picture
/// before stays. Not thread-safe.
class PictureWriter {
 public:
  /// `exchange` must outlive it.
  PictureWriter(PictureExchange& exchange, const transport::SessionMessage& session);

  /// From the next frame on this is drawn as the agreed state, which it must be of; null: the timeline's.
  void draw_instead(const State* state) {
    instead_ = state;
    accelerations_.forget(jumps_.size());
  }

  /// Once somebody samples: of the snapshot that is held, and of each that is loaded.
  void on_loaded(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns);
  /// After ClientTimeline::apply().
  void on_applied(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns);
  /// Another timeline of the same session tells of the same frame; what it says elsewise is blended in.
  void on_changed(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns);
  /// Frames beyond the agreed one were simulated, or simulated again.
  void on_simulated(const ClientTimeline& timeline, const Pacer& pacer);
  /// From the next on_clock() on.
  void on_echo(const std::optional<GravityEcho>& echo) { picture_.echo = echo; }
  /// The estimate of the server's clock may have changed.
  void on_clock(const Pacer& pacer);

 private:
  // `next` is the picture in the making.
  [[nodiscard]] const DrawnFrame* draw(const State& state, Frame frame, const Picture& next);
  void show_agreed(Picture& next, const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns);
  void draw_ahead(const ClientTimeline& timeline, Picture& next);
  void show(const Picture& next, const Pacer& pacer);
  /// False until a first picture was made: there is nothing that it could follow.
  [[nodiscard]] bool follows() const { return picture_.agreed != nullptr; }

  PictureExchange& exchange_;
  Picture picture_;
  const State* instead_ = nullptr;
  std::vector<std::uint8_t> jumps_;
  Accelerations accelerations_;
};

}  // namespace tandem::client
