#include "tests/fault/world/actors/camera.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

namespace tandem::world {

/// The truth, and perhaps a recording beside it.
class Camera::Both final : public client::CoreListener {
 public:
  Both(Stage& stage, recording::Recorder* recorder) : witness_(stage, "camera") {
    if (recorder != nullptr)
      capture_.emplace(*recorder, recording::Clocks{&Clock::shown, &Clock::shown_wall});
  }
  void watch(const client::ClientCore& core) {
    witness_.watch(core);
    if (capture_) capture_->watch(core);
  }
  void turned(client::Now now) {
    if (capture_) capture_->turned(now);
  }
  void on_session(const transport::SessionMessage& session) override { witness_.on_session(session); }
  void on_names(const transport::SessionMessage& session) override {
    if (capture_) capture_->on_names(session);
  }
  void on_stream(const transport::StreamMessage& stream) override {
    witness_.on_stream(stream);
    if (capture_) capture_->on_stream(stream);
  }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override {
    witness_.on_snapshot(snapshot);
    if (capture_) capture_->on_snapshot(snapshot);
  }
  void on_scheduled(const transport::ScheduledInputMessage& input) override {
    witness_.on_scheduled(input);
    if (capture_) capture_->on_scheduled(input);
  }
  void on_applied(Epoch epoch, const client::CompleteDelta& delta) override {
    witness_.on_applied(epoch, delta);
    if (capture_) capture_->on_applied(epoch, delta);
  }

 private:
  Witness witness_;
  std::optional<recording::Capture> capture_;
};

Camera::Camera(Stage& stage, const std::string& record) : Actor(stage, "camera"), file_(record) {}

Camera::~Camera() = default;

std::vector<transport::ParticipantId> Camera::participants() const {
  if (!port_) return {};
  return {port_->self()};
}

void Camera::on_start() {
  if (!file_.empty()) {
    auto made = recording::Recorder::create(file_, recording::Compression::kZstd);
    if (!made) throw std::runtime_error(made.error().message);
    recorder_ = std::make_unique<recording::Recorder>(std::move(*made));
  }
  port_ = std::move(*stage_.network.make_client("default"));
  listener_ = std::make_unique<Both>(stage_, recorder_.get());
  client::CoreOptions options;
  options.session = "default";
  options.id = 999;
  options.role = transport::Role::kObserver;
  core_ = std::make_unique<client::ClientCore>(std::move(options), *port_, listener_.get());
  listener_->watch(*core_);
}

void Camera::on_crash(bool /*power_fails*/) {}
void Camera::on_leave() {}

void Camera::on_poll() {
  const client::Now now{steady_ns(), wall_ns()};
  due_ns_ = std::min(core_->poll(now), steady_ns() + 100 * kMs);
  listener_->turned(now);
  add_events();
}

void Camera::add_events() {
  const auto& events = stage_.journal.events();
  for (; recorder_ && events_told_ < events.size(); ++events_told_) {
    const Event& event = events[events_told_];
    recorder_->add_event(event.who, event.what,
                         {clock().steady_ns(event.at_ns), clock().wall_ns(event.at_ns)});
  }
}

Result<void> Camera::finish() {
  add_events();
  return recorder_ ? recorder_->finish() : Result<void>();
}

}  // namespace tandem::world
