#pragma once
// A server that stands by: it follows the live one and decides when to take over. idl/STATES.md, "Servers
// that stand by".

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/transport/port.hpp"
#include "sdk/transport/units.hpp"
#include "services/checkpoint/checkpoint.hpp"
#include "services/standby/assembly.hpp"

namespace tandem::standby {

struct Options {
  std::string session = "default";
  transport::ClientId id = 0;  ///< random, not 0
  std::uint32_t rank = 1;      ///< the lowest takes over first
  Epoch epoch = 0;             ///< ms of wall clock at the process's start; clients never see it
};

/// What a takeover begins from.
struct Takeover {
  std::shared_ptr<const checkpoint::Checkpoint> checkpoint;
  /// The entries after it, without a gap.
  std::vector<transport::JournalMessage> journal;
  transport::ParticipantId from;  ///< the server that was live
  bool handed_over = false;       ///< that server asked for it
};

/// Receives checkpoints and the journal of the live server, and tells everybody that it stands by as soon as
/// it could take over. Follows one server at a time; all bytes are untrusted. Reads no clock, owns no thread.
/// Not thread-safe.
class Standby {
 public:
  /// Whether this machine could go on from a checkpoint; the error is told in the log.
  using Accept = std::function<Result<void>(const checkpoint::Checkpoint&)>;

  /// A server takes over this much later for each living one that comes before it.
  static constexpr std::int64_t kRankNs = kSecond;
  /// Limits of the journal behind the last checkpoint. Entries beyond them are dropped.
  static constexpr std::size_t kMostEntries = 65'536;
  static constexpr std::size_t kMostJournalBytes = std::size_t{64} << 20U;

  /// `port` must outlive the object. Errors: those of ServerPort::follow().
  static Result<std::unique_ptr<Standby>> create(Options options, transport::ServerPort& port, Accept accept);

  /// Takes what arrived. Returns true if it is time to take over: call take_over() then.
  bool poll(std::int64_t now_ns);
  /// When poll() has something to do even if nothing arrives; at most 50 ms ahead.
  [[nodiscard]] std::int64_t next_wake_ns() const { return wake_ns_; }
  /// Ends standing by, and returns what to go on from. Precondition: poll() returned true.
  [[nodiscard]] Takeover take_over();

  /// The live server's epoch; 0: none is known.
  [[nodiscard]] Epoch follows() const { return live_ ? live_->message.epoch : 0; }
  /// Frame of the checkpoint held; 0: none.
  [[nodiscard]] Frame holds() const { return checkpoint_ ? checkpoint_->frame : 0; }
  /// The last frame that it knows was made; it would step from holds() up to there.
  [[nodiscard]] Frame live_frame() const;
  /// Lines for a log since the last call.
  [[nodiscard]] std::vector<std::string> take_notices();

 private:
  using Announcement = transport::Received<transport::SessionMessage>;

  Standby(Options options, transport::ServerPort& port, Accept accept);
  void look_around(std::int64_t now_ns);
  void follow(const Announcement& server);
  void take_journal();
  void take_checkpoints(std::int64_t now_ns);
  void hold(const Assembly::Whole& whole, std::int64_t now_ns);
  void refuse(const std::string& why, std::int64_t now_ns);
  void tell(std::int64_t now_ns);
  void announce();
  void publish_status(std::int64_t now_ns);
  [[nodiscard]] bool is_time(std::int64_t now_ns);
  [[nodiscard]] bool was_last() const;
  /// The entries after the checkpoint, up to the first gap.
  [[nodiscard]] std::size_t usable_entries() const;
  [[nodiscard]] bool from_live(Epoch epoch, const transport::ParticipantId& from) const;

  Options options_;
  transport::ServerPort* port_;
  Accept accept_;

  std::optional<Announcement> live_;
  bool live_is_there_ = false;
  std::uint32_t before_us_ = 0;  // living servers that stand by and come before this one
  std::vector<Announcement> servers_;
  std::int64_t looked_ns_ = INT64_MIN / 2;

  std::shared_ptr<const checkpoint::Checkpoint> checkpoint_;
  Assembly assembly_;
  std::deque<transport::JournalMessage> journal_;  // ascending by number
  std::size_t journal_bytes_ = 0;
  std::vector<transport::Received<transport::JournalMessage>> entries_;
  std::vector<transport::Received<transport::CheckpointMessage>> parts_;

  std::optional<transport::SessionMessage> announced_;
  std::optional<std::int64_t> gone_ns_;  // since when the live server is gone
  std::int64_t told_ns_ = INT64_MIN / 2, status_ns_ = INT64_MIN / 2, refused_ns_ = INT64_MIN / 2;
  std::int64_t started_ns_ = 0;
  bool news_ = false;  // something arrived that the live server should know
  std::int64_t wake_ns_ = 0;
  std::vector<std::string> notices_;
};

}  // namespace tandem::standby
