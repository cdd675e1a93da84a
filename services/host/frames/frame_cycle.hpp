#pragma once
// Where a running simulation is in making its frames.

#include <cstdint>
#include <optional>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem::host {

/// Of each frame, the step begins, is taken over, and the frame is made. Where steps overlap, the next one
/// may begin in between, early. Another order is a mistake of the caller, which is asserted. Not thread-safe.
class FrameCycle {
 public:
  enum class Stage : std::uint8_t {
    kIdle,           ///< frame() is made, and no step was begun since
    kStepping,       ///< the step of the frame after it is under way
    kSteppingAlone,  ///< the same, and no other begins before its frame is made
    kTaken,          ///< that step was taken over, and its frame is not made
    kTakenAlone,     ///< the same, and no other begins before that
    kTakenEarly,     ///< the same, and the next step was begun and is under way
    kEnded,          ///< a step could not be taken over: there are no more frames
  };
  enum class Event : std::uint8_t { kBegin, kRest, kTake, kMake, kEnd };

  /// The stage that an event leads to; empty: it must not happen in that stage.
  [[nodiscard]] static constexpr std::optional<Stage> after(Stage stage, Event event) {
    using enum Stage;
    switch (event) {
      case Event::kBegin:
        if (stage == kIdle) return kStepping;
        if (stage == kTaken) return kTakenEarly;
        break;
      case Event::kRest:
        if (stage == kStepping || stage == kSteppingAlone) return kSteppingAlone;
        if (stage == kIdle || stage == kEnded) return stage;
        break;
      case Event::kTake:
        if (stage == kStepping) return kTaken;
        if (stage == kSteppingAlone) return kTakenAlone;
        break;
      case Event::kMake:
        if (stage == kTaken || stage == kTakenAlone) return kIdle;
        if (stage == kTakenEarly) return kStepping;
        break;
      case Event::kEnd:
        if (stage == kStepping || stage == kSteppingAlone) return kEnded;
        break;
    }
    return std::nullopt;
  }

  /// `made`: the frame that the simulation's bodies are of. `overlaps`: steps may begin early.
  FrameCycle(Frame made, bool overlaps) : frame_(made), overlaps_(overlaps) {}

  /// The step of next_frame() begins.
  void begin() {
    go(Event::kBegin);
    if (!overlaps_) go(Event::kRest);
  }
  /// No step begins early before the frame of the step under way, if there is one, is made.
  void rest() { go(Event::kRest); }
  /// The step under way was taken over.
  void take() { go(Event::kTake); }
  /// The frame whose step was taken over is made: it is frame() from now on.
  void make() {
    go(Event::kMake);
    ++frame_;
  }
  /// The step under way cannot be taken over.
  void end() { go(Event::kEnd); }

  [[nodiscard]] Stage stage() const { return stage_; }
  /// The frame that was made last.
  [[nodiscard]] Frame frame() const { return frame_; }
  /// The first frame whose step has not begun.
  [[nodiscard]] Frame next_frame() const {
    if (stage_ == Stage::kIdle || stage_ == Stage::kEnded) return frame_ + 1;
    return stage_ == Stage::kTakenEarly ? frame_ + 3 : frame_ + 2;
  }
  /// A step is under way: the simulation must be left alone.
  [[nodiscard]] bool stepping() const {
    return stage_ == Stage::kStepping || stage_ == Stage::kSteppingAlone || stage_ == Stage::kTakenEarly;
  }
  /// A step was taken over whose frame is not made.
  [[nodiscard]] bool taken() const {
    return stage_ == Stage::kTaken || stage_ == Stage::kTakenAlone || stage_ == Stage::kTakenEarly;
  }
  /// The next step may begin before the frame at hand is made.
  [[nodiscard]] bool may_begin_early() const { return stage_ == Stage::kTaken; }

 private:
  void go(Event event) {
    const auto next = after(stage_, event);
    TANDEM_ASSERT(next.has_value());
    stage_ = *next;
  }

  Stage stage_ = Stage::kIdle;
  Frame frame_;
  bool overlaps_;
};

}  // namespace tandem::host
