#pragma once
// A planned handover of a session to a server that stands by.

#include <cstdint>
#include <string>

#include "services/host/succession/standbys.hpp"

namespace tandem::host {

/// Goes through a handover: the best server that stands by gets a fresh checkpoint; then one more frame is
/// made, and the journal says that it is the last; then nothing is made or decided until the other server
/// announces itself. That server gets a checkpoint of the last frame, too, in case that its engine cannot
/// follow the journal. If it takes too long, the session goes on here. Not thread-safe.
class Handover {
 public:
  static constexpr std::int64_t kPreparesNs = 10 * kSecond;  ///< maximum until the last frame
  static constexpr std::int64_t kWaitsNs = 3 * kSecond;      ///< maximum until the other is live

  /// An operator asked for it when `frame` was the last one made. No effect during a handover.
  void ask(const Standbys& standbys, Frame frame, Notices& notices, std::int64_t now_ns);
  /// Call in each poll.
  void look(const Standbys& standbys, Notices& notices, std::int64_t now_ns);
  /// A frame was made; returns true if the journal has to say that it is the last one.
  [[nodiscard]] bool made(std::int64_t now_ns);

  /// True if a checkpoint of the frame that was just made is needed.
  [[nodiscard]] bool wants_checkpoint() const { return step_ == Step::kPreparing || stopped(); }
  /// True if nothing may be made or decided.
  [[nodiscard]] bool stopped() const { return step_ == Step::kStopped; }
  /// True if the frame at hand is the last, or was: no other may be begun.
  [[nodiscard]] bool ends() const { return step_ == Step::kLastFrame || stopped(); }
  /// The server that takes over.
  [[nodiscard]] transport::ClientId to() const { return to_; }

 private:
  enum class Step : std::uint8_t { kNone, kPreparing, kLastFrame, kStopped };
  void give_up(const std::string& why, Notices& notices, std::int64_t now_ns);

  Step step_ = Step::kNone;
  transport::ClientId to_ = 0;
  Frame asked_ = 0;
  std::int64_t since_ns_ = 0;
  bool told_ = false;  // that the last frame was made
};

}  // namespace tandem::host
