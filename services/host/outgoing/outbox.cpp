#include "services/host/outgoing/outbox.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/cdr.hpp"

namespace tandem::host {

// Deltas are not counted, because they never come without the end of their frame.
std::uint32_t* Outbox::count_of(const Outgoing& message, std::uint32_t& limit) {
  if (std::holds_alternative<transport::DeltaMessage>(message)) return nullptr;
  if (std::holds_alternative<EndOfFrame>(message)) {
    limit = limits_.frames;
    return &frames_;
  }
  if (std::holds_alternative<SnapshotPart>(message)) {
    limit = limits_.snapshots;
    return &snapshots_;
  }
  if (std::holds_alternative<CheckpointPart>(message)) {
    limit = limits_.checkpoints;
    return &checkpoints_;
  }
  limit = limits_.control;
  return &control_;
}

bool Outbox::has_frame_room(std::uint32_t frames) const {
  const std::scoped_lock lock(mutex_);
  return frames_ + frames <= limits_.frames;
}

bool Outbox::has_control_room() const {
  const std::scoped_lock lock(mutex_);
  return control_ < limits_.control;
}

bool Outbox::has_snapshot_room() const {
  const std::scoped_lock lock(mutex_);
  return snapshots_ < limits_.snapshots;
}

bool Outbox::has_checkpoint_room() const {
  const std::scoped_lock lock(mutex_);
  return checkpoints_ < limits_.checkpoints;
}

void Outbox::weigh(const Outgoing& message) {
  cdr_.clear();
  if (const auto* reply = std::get_if<transport::ReplyMessage>(&message)) {
    transport::write_cdr(*reply, cdr_);
    traffic_.replies += cdr_.size();
  } else if (const auto* input = std::get_if<transport::ScheduledInputMessage>(&message)) {
    transport::write_cdr(*input, cdr_);
    traffic_.scheduled_inputs += cdr_.size();
  }
}

bool Outbox::push(Outgoing message) {
  {
    const std::scoped_lock lock(mutex_);
    std::uint32_t limit = 0;
    std::uint32_t* const count = count_of(message, limit);
    if (count != nullptr && *count >= limit) return false;
    if (count != nullptr) ++*count;
    weigh(message);
    queue_.push_back(std::move(message));
    high_water_ = std::max(high_water_, queue_.size());
  }
  ready_.notify_one();
  return true;
}

std::optional<Outgoing> Outbox::pop(std::chrono::nanoseconds timeout) {
  std::unique_lock lock(mutex_);
  if (queue_.empty() && timeout.count() > 0) ready_.wait_for(lock, timeout);
  if (queue_.empty()) return std::nullopt;
  std::optional<Outgoing> message(std::move(queue_.front()));
  queue_.pop_front();
  std::uint32_t limit = 0;
  if (std::uint32_t* const count = count_of(*message, limit)) {
    TANDEM_ASSERT(*count > 0);
    --*count;
  }
  return message;
}

void Outbox::wake() { ready_.notify_all(); }

std::size_t Outbox::size() const {
  const std::scoped_lock lock(mutex_);
  return queue_.size();
}

std::uint32_t Outbox::unwritten_frames() const {
  const std::scoped_lock lock(mutex_);
  return frames_;
}

Outbox::Traffic Outbox::traffic() const {
  const std::scoped_lock lock(mutex_);
  return traffic_;
}

std::size_t Outbox::high_water() const {
  const std::scoped_lock lock(mutex_);
  return high_water_;
}

namespace {

struct Write {
  transport::ServerPort& port;

  Result<void> operator()(const EndOfFrame& /*end*/) const { return {}; }
  Result<void> operator()(const OpenClient& open) const { return port.open_client(open.client); }
  Result<void> operator()(const CloseClient& close) const {
    port.close_client(close.client);
    return {};
  }
  Result<void> operator()(const SnapshotPart& snapshot) const {
    return port.write(snapshot.client, snapshot.part);
  }
  Result<void> operator()(const OpenStandby& open) const { return port.open_standby(open.standby); }
  Result<void> operator()(const CloseStandby& close) const {
    port.close_standby(close.standby);
    return {};
  }
  Result<void> operator()(const CheckpointPart& checkpoint) const {
    return port.write(checkpoint.standby, checkpoint.part);
  }
  template <class M>
  Result<void> operator()(const M& sample) const {
    return port.write(sample);
  }
};

}  // namespace

Result<void> publish(transport::ServerPort& port, const Outgoing& message) {
  return std::visit(Write{port}, message);
}

Result<void> drain(Outbox& outbox, transport::ServerPort& port) {
  while (const auto message = outbox.pop(std::chrono::nanoseconds{0})) {
    if (auto written = publish(port, *message); !written) return written;
  }
  return {};
}

}  // namespace tandem::host
