#pragma once
// Pictures of one epoch's timeline, for sampling.

#include <cstdint>
#include <vector>

#include "sdk/client/picture.hpp"
#include "sdk/client/server_clock.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/transport/messages.hpp"

namespace tandem::client {

/// Follows a timeline and shows what is new of it. Costs nothing until somebody samples; from then on a copy
/// of what is drawn for each frame that is applied or simulated ahead. Not thread-safe.
class PictureWriter {
 public:
  /// `exchange` must outlive it.
  PictureWriter(PictureExchange& exchange, const transport::SessionMessage& session);

  /// From the next frame on this is drawn as the agreed state, which it must be of; null: the timeline's.
  void draw_instead(const State* state) {
    instead_ = state;
    accelerations_.forget(jumps_.size());
  }

  /// A snapshot was loaded, or somebody samples for the first time.
  void on_loaded(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns);
  /// After ClientTimeline::apply().
  void on_applied(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns);
  /// Frames beyond the agreed one were simulated, or simulated again.
  void on_simulated(const ClientTimeline& timeline, const Pacer& pacer);
  /// From the next on_clock() on.
  void on_echo(const std::optional<GravityEcho>& echo) { picture_.echo = echo; }
  /// The estimate of the server's clock may have changed.
  void on_clock(const Pacer& pacer);

 private:
  [[nodiscard]] const DrawnFrame* draw(const State& state, Frame frame);
  [[nodiscard]] const DrawnFrame* draw_agreed(const ClientTimeline& timeline);
  void draw_ahead(const ClientTimeline& timeline);
  void show(const Pacer& pacer);
  /// False until a first picture was made: there is nothing that it could follow.
  [[nodiscard]] bool follows() const { return picture_.agreed != nullptr; }

  PictureExchange& exchange_;
  Picture picture_;
  const State* instead_ = nullptr;
  std::vector<std::uint8_t> jumps_;
  Accelerations accelerations_;
};

}  // namespace tandem::client
