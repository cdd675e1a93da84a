#pragma once
// `tandem record`: an observer that writes what it receives into a real file, which is then played back.

#include <cstdint>
#include <memory>
#include <string>

#include "services/follow/recording/recording_sink.hpp"
#include "services/tool/recording_port.hpp"
#include "tests/fault/world/actors/client.hpp"

namespace tandem::world {

class RecorderActor final : public Actor {
 public:
  RecorderActor(Stage& stage, std::string name, const Service& server, std::uint64_t first_id);
  ~RecorderActor() override;

  void set_disk_full(bool full) override { full_ = full; }
  [[nodiscard]] std::vector<transport::ParticipantId> participants() const override;
  void check() override;
  void check_end() override;

 protected:
  void on_start() override;
  void on_crash(bool power_fails) override;
  void on_leave() override;
  void on_poll() override;
  [[nodiscard]] std::int64_t due_ns() const override { return due_ns_; }

 private:
  class Counting;
  void finish();
  /// Plays the file back: every frame is one that the world knows. `least`: frames that have to be there.
  void play_back(std::uint64_t least);
  void drop();

  const Service& server_;
  std::uint64_t next_id_;
  std::string path_;
  std::unique_ptr<transport::ClientPort> port_;
  std::unique_ptr<recording::Recorder> recorder_;
  std::unique_ptr<tool::RecordingPort> recording_port_;
  std::unique_ptr<following::SessionClient> client_;
  std::unique_ptr<recording::RecordingSink> recording_;
  std::unique_ptr<Counting> counting_;
  std::int64_t due_ns_ = 0;
  bool full_ = false;
};

}  // namespace tandem::world
