#pragma once
// What is true in a world, whoever says otherwise: hashes of frames, and the frames on which inputs acted.

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "sdk/core/layout/layout.hpp"

namespace tandem::world {

/// The frames of one epoch, with those before it that it continues.
struct Lineage {
  Epoch continues_epoch = 0;
  Frame continues_frame = 0;
  Frame last = 0;                 ///< the newest frame that was made
  bool announced = false;         ///< clients may know of it
  std::map<double, Frame> acted;  ///< by the value that makes each input unique
};

class Truth {
 public:
  /// A server begins an epoch. Returns what is wrong with that; empty if nothing is. An epoch that was never
  /// announced may begin again: nobody knows of it.
  [[nodiscard]] std::string begin(Epoch epoch, Epoch continues_epoch, Frame continues_frame);
  /// A server announces the epoch that it began. Returns what is wrong.
  [[nodiscard]] std::string announce(Epoch epoch);
  /// An input acted in the engine. Returns what is wrong.
  [[nodiscard]] std::string act(Epoch epoch, double value, Frame frame);
  void made(Epoch epoch, Frame frame);
  /// Somebody, perhaps the server, holds a state. Returns what is wrong.
  [[nodiscard]] std::string hold(Epoch epoch, std::uint32_t stream, Frame frame, std::uint64_t hash);
  [[nodiscard]] bool knows(Epoch epoch, std::uint32_t stream, Frame frame) const;

  [[nodiscard]] const Lineage* lineage(Epoch epoch) const;
  /// The frame on which an input acted, as an epoch has it.
  [[nodiscard]] std::optional<Frame> acted(Epoch epoch, double value) const;
  [[nodiscard]] std::size_t acts() const { return acts_; }
  [[nodiscard]] std::size_t epochs() const { return lineages_.size(); }

 private:
  struct State {
    Epoch epoch = 0;
    std::uint32_t stream = 0;
    Frame frame = 0;
    auto operator<=>(const State&) const = default;
  };
  std::map<Epoch, Lineage> lineages_;
  std::map<State, std::uint64_t> hashes_;
  std::size_t acts_ = 0;
};

}  // namespace tandem::world
