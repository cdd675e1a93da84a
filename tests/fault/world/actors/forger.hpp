#pragma once
// A participant of the session that sends arbitrary samples, under its own names and under those of others.

#include <cstdint>
#include <memory>
#include <vector>

#include "tests/fault/world/stage.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem::world {

class Forger {
 public:
  Forger(Stage& stage, std::uint64_t salt);
  /// Sends one sample.
  void speak();
  /// Asks to join under the id of each client that the live server knows: again and again when it has just
  /// begun, else once a second.
  void squat();

 private:
  void speak_as_client();
  void speak_as_server();
  [[nodiscard]] transport::ClientId some_client();
  [[nodiscard]] transport::ClientId known_client();
  [[nodiscard]] Epoch some_epoch();
  [[nodiscard]] Frame some_frame();
  [[nodiscard]] double some_value();
  [[nodiscard]] transport::Bytes some_bytes(std::uint64_t most);

  Stage& stage_;
  Dice dice_;
  Epoch squats_in_ = 0;
  std::int64_t squats_since_ns_ = 0, squatted_ns_ = 0;
  std::unique_ptr<transport::ClientPort> client_;
  std::unique_ptr<transport::ServerPort> server_;
};

}  // namespace tandem::world
