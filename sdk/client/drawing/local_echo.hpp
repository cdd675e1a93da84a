#pragma once
// An application's own gravity, shown before the session has it.

#include <cstdint>
#include <optional>

#include "sdk/client/drawing/picture.hpp"

namespace tandem::client {

/// The newest gravity that this client sent, until it acts, is refused or is lost. Not thread-safe.
class LocalEcho {
 public:
  /// `gravity`: 1/64 lattice unit per frame^2. `frame`: the server's frame at this moment.
  void on_sent(std::uint64_t number, const std::array<float, 3>& gravity, double frame) {
    number_ = number;
    acts_.reset();
    shown_ = GravityEcho{gravity, frame};
  }
  /// The server has scheduled it.
  void on_scheduled(std::uint64_t number, Frame acts) {
    if (number == number_) acts_ = acts;
  }
  /// The input acted, was refused or is lost.
  void on_over(std::uint64_t number) {
    if (number == number_) clear();
  }
  /// From the frame that the input acts on, the motion itself shows it.
  void on_simulated(Frame now) {
    if (acts_ && now >= *acts_) clear();
  }
  void clear() {
    number_ = 0;
    acts_.reset();
    shown_.reset();
  }
  [[nodiscard]] const std::optional<GravityEcho>& shown() const { return shown_; }

 private:
  std::uint64_t number_ = 0;  // 0: none
  std::optional<Frame> acts_;
  std::optional<GravityEcho> shown_;
};

}  // namespace tandem::client
