#pragma once
// The drawn part of the client state, handed from the thread that applies to the threads that sample.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/client/drawing/mutex.hpp"
#include "sdk/client/drawing/server_clock.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem::client {

/// The columns of one frame that sampling reads: 30 bytes a slot, 58 with orientations.
struct DrawnFrame {
  Frame frame = 0;
  std::array<std::vector<std::int32_t>, kPositionChannels> p;
  std::array<std::vector<std::int32_t>, kPositionChannels> v;    ///< predicted velocity from this frame to
                                                                 ///< the next
  std::array<std::vector<std::int32_t>, kQuaternionChannels> q;  ///< empty without orientations
  std::array<std::vector<std::int32_t>, kSpinChannels> w;        ///< empty without orientations
  std::vector<std::uint8_t> alive;
  std::vector<std::uint8_t> reuse;
  std::vector<TypeId> type;
  std::vector<std::uint8_t> motion;  ///< kMoves, kFalls
  std::vector<std::uint8_t> jumps;   ///< counts spawns and teleports in the slot since the snapshot, wraps

  std::uint32_t alive_count = 0;
  Vec3i gravity{};  ///< 1/64 lattice unit per frame^2

  static constexpr std::uint8_t kMoves = 1;  ///< a body that is not at rest
  static constexpr std::uint8_t kFalls = 2;  ///< a moving body whose velocity only gravity changes

  [[nodiscard]] bool has_orientations() const { return !q[0].empty(); }
  [[nodiscard]] Quaternion quaternion(Slot slot) const {
    return {q[0][slot], q[1][slot], q[2][slot], q[3][slot]};
  }
  [[nodiscard]] Spin spin(Slot slot) const { return {w[0][slot], w[1][slot], w[2][slot]}; }
};

/// The expected change of velocities, learned from the last predicted step. A step that changed a velocity by
/// more than gravity does in 1.5 frames was a collision, which says nothing about the next step.
struct Accelerations {
  std::array<std::vector<std::int32_t>, kPositionChannels> a;  ///< 1/64 lattice unit per frame^2
  std::vector<std::uint8_t> falls;                             ///< 1: the velocity changes as by gravity
  Vec3i gravity{};

  void forget(std::size_t capacity);
  void learn(const State& before, const State& after, const Vec3i& drive);
};

/// Copies the part of `state`, the state of `frame`, that sampling reads. `jumps`: one count per slot.
/// Allocates if `drawn` held fewer slots.
void draw(const State& state, Frame frame, std::span<const std::uint8_t> jumps,
          const Accelerations& accelerations, DrawnFrame& drawn);

/// A gravity that the application sent and that is not in force yet.
struct GravityEcho {
  std::array<float, kPositionChannels> gravity{};  ///< 1/64 lattice unit per frame^2
  double frame = 0;                                ///< when it was sent
};

/// All data of one moment that sample() reads. The frames belong to a PictureExchange.
struct Picture {
  Epoch epoch = 0;
  double lattice_unit = 0;               ///< scene units
  std::uint64_t load = 0;                ///< number of the snapshot; every body may have jumped between two
                                         ///< snapshots
  const DrawnFrame* before = nullptr;    ///< the agreed frame before `agreed`; null right after a snapshot
  const DrawnFrame* agreed = nullptr;    ///< the last frame agreed with the server
  const DrawnFrame* ahead = nullptr;     ///< the last frame simulated; equal to `agreed` if nothing is ahead
  std::int64_t agreed_ns = 0;            ///< steady time at which `agreed` was reached
  std::optional<GravityEcho> echo = {};  ///< the echo to show
  Pacer pacer;
};

/// Hands pictures from one thread to any number of readers of the last one. The mutex between the two sides
/// is held while a picture's few values are copied, never while the columns of a frame are written or read.
/// So neither side waits for the other's work. Readers wait for each other.
class PictureExchange {
 public:
  /// A reader samples: from now on pictures have to be shown.
  void want() { wanted_ = true; }
  [[nodiscard]] bool wanted() const { return wanted_; }

  // For the thread that shows.

  /// A frame to write into. No reader sees it, and neither the last picture nor `next` uses it.
  [[nodiscard]] DrawnFrame& unused(const Picture& next);
  /// A new number for Picture::load; never the same twice.
  [[nodiscard]] std::uint64_t count_load() { return ++loads_; }
  void show(const Picture& picture);
  /// Removes the picture: there is nothing to draw any more.
  void clear();

  /// Keeps the last picture unchanged while the object lives. The same thread must make and destroy it.
  class Reading {
   public:
    explicit Reading(PictureExchange& exchange);
    ~Reading();
    Reading(const Reading&) = delete;
    Reading& operator=(const Reading&) = delete;
    /// The picture; null if there is nothing to draw.
    [[nodiscard]] const Picture* picture() const;

   private:
    PictureExchange& exchange_;
    Lock turn_;
  };

 private:
  // Three frames of the last picture, three of the one being read, two of the next.
  static constexpr std::size_t kFrames = 8;

  std::atomic<bool> wanted_ = false;
  std::uint64_t loads_ = 0;
  std::array<DrawnFrame, kFrames> frames_;  // each allocates when it is first used
  Mutex readers_;                           // held while reading
  Mutex mutex_;                             // guards what follows
  std::optional<Picture> last_;
  std::optional<Picture> read_;  // being read
};

}  // namespace tandem::client
