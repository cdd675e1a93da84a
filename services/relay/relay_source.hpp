#pragma once
// Makes a host's frames of those that a relay follows.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "services/host/frames/frame_source.hpp"
#include "services/host/host.hpp"
#include "services/relay/upstream.hpp"

namespace tandem::relay {

/// Publishes one epoch of a session again, with the same epoch, frames, payloads and hashes. A frame is there
/// when every stream that is passed on has it; a stream that is late is left out, and who plays it joins
/// again. Not thread-safe.
class RelaySource final : public host::FrameSource {
 public:
  /// The other streams do not wait longer for one.
  static constexpr std::int64_t kLateNs = kSecond / 2;
  /// A host that takes over does not know who plays which stream until all have acknowledged frames of it:
  /// observers do so every 2 s.
  static constexpr std::int64_t kAllNs = 4 * kSecond;

  /// `upstream` must outlive this, and its first stream plays.
  explicit RelaySource(Upstream& upstream);

  /// What a host needs of the session. The caller sets the limits of clients.
  [[nodiscard]] static host::ServiceConfig config_of(const transport::SessionMessage& session);

  [[nodiscard]] const transport::SessionMessage& session() const override { return session_; }
  [[nodiscard]] Frame frame() const override { return frame_; }
  [[nodiscard]] host::StreamSet active() const override;
  void set_active(host::StreamSet streams) override;
  [[nodiscard]] const State& agreed(std::uint32_t stream) const override;
  [[nodiscard]] host::BodyCounts bodies(std::uint32_t stream) const override;
  [[nodiscard]] std::uint64_t hash(std::uint32_t stream) const override;
  [[nodiscard]] const StreamParameters& parameters(std::uint32_t stream) const override;
  [[nodiscard]] bool is_fed() const override { return true; }
  [[nodiscard]] bool next_ready() override;
  host::StreamSet prepare(host::StreamSet streams) override;
  std::optional<host::MadeFrame> next(host::StreamSet snapshots_follow, host::Outbox& outbox) override;
  void snapshot(std::uint32_t stream, std::vector<std::byte>& out) override;
  host::InputVerdict accept(const transport::InputMessage& input, const host::InputTerms& terms,
                            host::Outbox& outbox) override;
  void take_outcomes(std::vector<host::InputVerdict>& out) override { upstream_->take_outcomes(out); }
  bool refresh_names() override;
  [[nodiscard]] std::string name(std::uint32_t stream) const override;
  [[nodiscard]] std::vector<std::string> take_notices(std::int64_t now_ns) override;

 private:
  [[nodiscard]] Feed* playing(std::uint32_t stream) const;
  /// The stream's state is that of frame(), and what its feed has queued goes on from there.
  [[nodiscard]] bool goes_on(std::uint32_t stream) const;
  void align();
  void hold_scheduled();

  Upstream* upstream_;
  transport::SessionMessage session_;
  Frame frame_ = 0;
  bool passed_on_ = false;                                      // a frame
  bool goes_on_ = false;                                        // it takes over, or was restarted
  std::optional<std::int64_t> all_until_ns_;                    // meanwhile it passes on all streams
  host::StreamSet wanted_{1};                                   // by the host
  host::StreamSet synced_{1};                                   // goes_on()
  std::array<std::int64_t, transport::kMaxStreams> late_ns_{};  // since when it keeps others waiting; 0: not
  std::map<std::uint64_t, transport::ScheduledInputMessage> scheduled_;  // not passed on yet
  std::uint64_t scheduled_to_ = 0;                                       // passed on up to this number
  std::vector<client::CompleteDelta> taken_;                             // of the last frame
  std::vector<host::MadeDelta> deltas_;
  std::vector<std::string> notices_;
  State none_;  // of a stream that does not play
};

}  // namespace tandem::relay
