#pragma once
// Makes frames from one run of a recording instead of a simulation.

#include <cstdint>
#include <optional>
#include <vector>

#include "services/follow/recording/playback.hpp"
#include "services/host/frames/frame_source.hpp"
#include "services/host/host.hpp"
#include "services/program/token_bucket.hpp"

namespace tandem::tool {

/// Publishes a run of a playback as a session of its own with the recorded stream. Recorded payloads, hashes
/// and scheduled inputs are sent unchanged. The only input that it takes is kSeek, which ends it.
class RecordedSource final : public host::FrameSource {
 public:
  /// `playback` must hold a state, outlive this, and be stepped by nobody else meanwhile. `seeks` limits how
  /// often clients may seek, for all runs that share it; it must outlive this. `config` must have a clock.
  RecordedSource(recording::Playback& playback, const host::ServiceConfig& config,
                 accounts::TokenBucket& seeks);

  [[nodiscard]] const transport::SessionMessage& session() const override { return session_; }
  [[nodiscard]] Frame frame() const override { return timeline().applied(); }
  [[nodiscard]] host::StreamSet active() const override { return {1}; }
  void set_active(host::StreamSet /*streams*/) override {}
  [[nodiscard]] const State& agreed(std::uint32_t /*stream*/) const override {
    return timeline().state(frame());
  }
  [[nodiscard]] std::uint64_t hash(std::uint32_t /*stream*/) const override { return timeline().hash(); }
  [[nodiscard]] const StreamParameters& parameters(std::uint32_t /*stream*/) const override {
    return timeline().parameters();
  }
  std::optional<host::MadeFrame> next(host::StreamSet snapshots_follow, host::Outbox& outbox) override;
  void snapshot(std::uint32_t /*stream*/, std::vector<std::byte>& out) override { timeline().snapshot(out); }
  host::InputVerdict accept(const transport::InputMessage& input, const host::InputTerms& terms,
                            host::Outbox& outbox) override;
  bool refresh_names() override;

  /// The time to continue at, in seconds since the recording's first message, after a client has asked for
  /// one.
  [[nodiscard]] std::optional<double> sought_s() const { return sought_s_; }
  /// After next() returned nothing without a seek: what the playback returned instead; kStarted if another
  /// run begins.
  [[nodiscard]] const Result<recording::Playback::Step>& ending() const { return ending_; }

 private:
  [[nodiscard]] const ClientTimeline& timeline() const { return playback_->timeline(); }

  recording::Playback* playback_;
  accounts::TokenBucket* seeks_;
  std::int64_t (*clock_ns_)();
  transport::SessionMessage session_;
  host::MadeDelta delta_;  // the last
  std::optional<double> sought_s_;
  Result<recording::Playback::Step> ending_ = recording::Playback::Step::kFrame;
};

}  // namespace tandem::tool
