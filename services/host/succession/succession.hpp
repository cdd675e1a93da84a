#pragma once
// All that a live server does for those that could succeed it.

#include <vector>

#include "sdk/wire/port.hpp"
#include "services/host/frames/journal.hpp"
#include "services/host/succession/handover.hpp"
#include "services/host/succession/standbys.hpp"

namespace tandem::host {

/// Keeps the servers that stand by informed, and obeys operators who ask for a handover. Not thread-safe.
class Succession {
 public:
  Succession(std::string session, Epoch epoch, Outbox& outbox)
      : session_(std::move(session)), epoch_(epoch), journal_(epoch, outbox), standbys_(epoch, outbox) {}

  /// Takes what servers and operators say, and queues the decisions that the journal has noted. `frame`: the
  /// last one made.
  void poll(transport::ServerPort& port, Frame frame, Notices& notices, std::int64_t now_ns);
  /// A frame was made, and its deltas are not queued yet.
  void made(FrameSource& source, std::int64_t now_ns);
  /// Queues parts of checkpoints.
  void send(std::int64_t now_ns) { standbys_.send(now_ns); }

  /// True if nothing may be made or decided here any more.
  [[nodiscard]] bool stopped() const { return handover_.stopped(); }
  /// True if no frame may be begun beside the one at hand.
  [[nodiscard]] bool ends() const { return handover_.ends(); }
  [[nodiscard]] bool wants_checkpoint_now() const { return handover_.wants_checkpoint(); }
  [[nodiscard]] Journal& journal() { return journal_; }
  [[nodiscard]] Standbys& standbys() { return standbys_; }

 private:
  static constexpr std::size_t kMaxObeyed = 64;

  std::string session_;
  Epoch epoch_;
  Journal journal_;
  Standbys standbys_;
  Handover handover_;
  std::vector<transport::Received<transport::StandbyMessage>> said_;
  std::vector<transport::Received<transport::CommandMessage>> commands_;
  std::vector<std::uint64_t> obeyed_;  // the last requests
};

}  // namespace tandem::host
