#include "tests/fault/world/actors/camera.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace tandem::world {

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
  client::CoreOptions options;
  options.session = "default";
  options.id = 999;
  options.role = transport::Role::kObserver;
  client_ = std::make_unique<following::SessionClient>(std::move(options), *port_);
  witness_.emplace(stage_, "camera").watch(*client_);
  sinks_ = {&*witness_};
  if (recorder_)
    sinks_.push_back(
        &recording_.emplace(*recorder_, *client_, recording::Clocks{&Clock::shown, &Clock::shown_wall}));
}

void Camera::on_crash(bool /*power_fails*/) {}
void Camera::on_leave() {}

void Camera::on_poll() {
  const client::Now now{steady_ns(), wall_ns()};
  due_ns_ = std::min(client_->poll(sinks_, now), steady_ns() + 100 * kMs);
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
