#pragma once
// An observer that no fault touches. It is there in every world, so that recording one changes nothing.

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/follow/recording/recording_sink.hpp"
#include "tests/fault/world/actors/client.hpp"

namespace tandem::world {

class Camera final : public Actor {
 public:
  /// `record`: the file to write, with the journal as a track of events; empty: none.
  Camera(Stage& stage, const std::string& record);
  ~Camera() override;

  [[nodiscard]] std::vector<transport::ParticipantId> participants() const override;
  /// Ends the file. Errors: kIo.
  [[nodiscard]] Result<void> finish();

 protected:
  void on_start() override;
  void on_crash(bool power_fails) override;
  void on_leave() override;
  void on_poll() override;
  [[nodiscard]] std::int64_t due_ns() const override { return due_ns_; }

 private:
  void add_events();

  std::string file_;
  std::unique_ptr<transport::ClientPort> port_;
  std::unique_ptr<recording::Recorder> recorder_;
  std::unique_ptr<following::SessionClient> client_;
  std::optional<WitnessSink> witness_;
  std::optional<recording::RecordingSink> recording_;
  std::vector<following::SessionSink*> sinks_;
  std::int64_t due_ns_ = 0;
  std::size_t events_told_ = 0;
};

}  // namespace tandem::world
