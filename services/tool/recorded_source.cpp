#include "services/tool/recorded_source.hpp"

#include <utility>

namespace tandem::tool {

using recording::Playback;

RecordedSource::RecordedSource(Playback& playback, const host::ServiceConfig& config)
    : playback_(&playback), session_(playback.session()) {
  transport::StreamMessage stream = playback.stream();
  stream.id = {};
  session_.streams.assign(1, std::move(stream));
  session_.session = config.session;
  session_.epoch = config.epoch;
  session_.frame_rate_hz = config.frame_rate_hz;
  session_.window_ceiling = config.window_ceiling;
  playback.timeline().rename(config.epoch, {});
}

std::optional<host::FrameSource::Made> RecordedSource::next(bool /*snapshot_follows*/, host::Outbox& outbox) {
  if (!ending_ || *ending_ != Playback::Step::kFrame) return std::nullopt;
  ending_ = playback_->next();
  if (!ending_ || *ending_ != Playback::Step::kFrame) return std::nullopt;
  for (transport::ScheduledInputMessage input : playback_->inputs()) {
    input.epoch = session_.epoch;
    if (!outbox.push(std::move(input))) {
      ending_ = fail(ErrorCode::kCapacity, "more scheduled inputs in a frame than can be queued");
      return std::nullopt;
    }
  }
  const client::CompleteDelta& delta = playback_->delta();
  return Made{.frame = delta.frame,
              .last_input = delta.last_input,
              .hash = delta.hash,
              .payload = delta.payload,
              .corrected = static_cast<std::uint32_t>(timeline().touched().size())};
}

}  // namespace tandem::tool
