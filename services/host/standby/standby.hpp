#pragma once
// A server that stands by: it follows the live one and decides when to take over. idl/STATES.md, "Servers
// that stand by".

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/wire/parcels.hpp"
#include "sdk/wire/port.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/checkpoint/checkpoint.hpp"
#include "services/host/standby/silence.hpp"

namespace tandem::standby {

struct StandbyOptions {
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
  Frame published = 0;            ///< the last frame of that server that is known
};

/// Receives checkpoints and the journal of the live server, and tells everybody that it stands by as soon as
/// it could take over. Follows one server at a time; all bytes are untrusted. Reads no clock, owns no thread.
/// Not thread-safe.
class Standby {
 public:
  /// A line for a log.
  struct Notice {
    std::string text;
    bool warning =
        false;  ///< something is wrong: it cannot stand by, it falls behind, or the live server hangs
  };
  /// Whether this machine could go on from a checkpoint of that session; the error is told in the log.
  using Accept = std::function<Result<void>(const checkpoint::Checkpoint&, const transport::SessionMessage&)>;
  /// Whether this machine makes the frames of a journal from a checkpoint on. Asked when a server hands over:
  /// if not, the checkpoint of the last frame is waited for.
  using Follows =
      std::function<bool(const checkpoint::Checkpoint&, std::span<const transport::JournalMessage>)>;

  /// A server takes over this much later for each living one that comes before it.
  static constexpr std::int64_t kRankNs = kSecond;
  /// The log says so, as often, if no checkpoint arrived for this long while the live server is there.
  static constexpr std::int64_t kSlowNs = 10 * kSecond;
  /// Limits of the journal behind the last checkpoint. Entries beyond them are dropped.
  static constexpr std::size_t kMaxEntries = 65'536;
  static constexpr std::size_t kMaxJournalBytes = std::size_t{64} << 20U;

  /// `port` must outlive the object. Errors: those of ServerPort::follow().
  static Result<std::unique_ptr<Standby>> create(StandbyOptions options, transport::ServerPort& port,
                                                 Accept accept, Follows follows);

  /// Takes what arrived. Returns true if it is time to take over: call take_over() then.
  bool poll(std::int64_t now_ns);
  /// When poll() has something to do even if nothing arrives; at most 50 ms ahead.
  [[nodiscard]] std::int64_t next_wake_ns() const { return wake_ns_; }
  /// The epoch of a takeover at that time of day: up to a second ahead of it, by the id. It is never that of
  /// a server which starts, nor that of one of another rank which takes over.
  [[nodiscard]] Epoch epoch_at(std::int64_t wall_ms) const {
    const Epoch about = static_cast<Epoch>(wall_ms) + checkpoint::kBeginners + options_.id % 997;
    return checkpoint::begun_by(1 + (options_.rank - 1) % (checkpoint::kBeginners - 1), about);
  }
  /// Ends standing by, and returns what to go on from. Precondition: poll() returned true.
  [[nodiscard]] Takeover take_over();

  /// The live server's epoch; 0: none is known.
  [[nodiscard]] Epoch follows() const { return live_ ? live_->message.epoch : 0; }
  /// Frame of the checkpoint held; 0: none.
  [[nodiscard]] Frame holds() const { return checkpoint_ ? checkpoint_->frame : 0; }
  /// The last frame of that world that it knows was made, at least holds().
  [[nodiscard]] Frame live_frame() const;
  /// Time since the newest checkpoint came that holds() is of; empty: there is none.
  [[nodiscard]] std::optional<std::int64_t> checkpoint_age_ns(std::int64_t now_ns) const {
    return checkpoint_ ? std::optional(now_ns - held_ns_) : std::nullopt;
  }
  /// Payload of the checkpoints and the journal of live servers.
  [[nodiscard]] std::uint64_t received_bytes() const { return received_bytes_; }
  /// Those since the last call.
  [[nodiscard]] std::vector<Notice> take_notices();

 private:
  using Announcement = transport::Received<transport::SessionMessage>;

  /// Why it is time to take over, or that it is not.
  enum class Cause : std::uint8_t { kNone, kGone, kSilent, kHandedOver };

  Standby(StandbyOptions options, transport::ServerPort& port, Accept accept, Follows follows);
  void look_around(std::int64_t now_ns);
  [[nodiscard]] const Announcement* choose_of_twins(const Announcement& twin, std::int64_t now_ns);
  void follow(const Announcement& server);
  void hear() {
    heard_live_ = true;
    silence_.broken();
  }
  void take_journal();
  void take_checkpoints(std::int64_t now_ns);
  void take_acknowledgements();
  void hold(const transport::CheckpointMessage& whole, std::int64_t now_ns);
  void refuse(const std::string& why, std::int64_t now_ns);
  void note_if_slow(std::int64_t now_ns);
  void tell(std::int64_t now_ns);
  void announce();
  void publish_status(std::int64_t now_ns);
  /// DDS says that the live server is there, but it works no longer.
  [[nodiscard]] bool is_silent() const;
  [[nodiscard]] Cause cause() const;
  [[nodiscard]] bool is_time(std::int64_t now_ns);
  /// True if this server takes over by a handover, and could do it now.
  [[nodiscard]] bool can_follow_the_last();
  /// The world that is held is of the server that is followed, not of one before.
  [[nodiscard]] bool holds_the_live() const {
    return checkpoint_ && live_ && checkpoint_->epoch == live_->message.epoch;
  }
  /// The entries after the checkpoint, up to the first gap.
  [[nodiscard]] std::size_t usable_entries() const;
  [[nodiscard]] bool from_live(Epoch epoch, const transport::ParticipantId& from) const;

  StandbyOptions options_;
  transport::ServerPort* port_;
  Accept accept_;
  Follows follows_;

  std::optional<Announcement> live_;
  bool live_is_there_ = false;
  bool heard_live_ = false;  // something came from it
  std::int64_t followed_ns_ = 0, told_of_twin_ns_ = INT64_MIN / 2;
  Silence silence_;              // of the live server
  Frame seen_applied_ = 0;       // the highest frame of its epoch that a client says it applied
  std::uint32_t before_us_ = 0;  // living servers that stand by and come before this one
  std::vector<Announcement> servers_;
  std::int64_t looked_ns_ = INT64_MIN / 2;

  std::shared_ptr<const checkpoint::Checkpoint> checkpoint_;
  transport::Parcels<transport::CheckpointMessage> parcels_;
  /// Entries of one epoch, ascending by number.
  struct Journal {
    std::deque<transport::JournalMessage> entries;
    std::size_t bytes = 0;
    bool handed_over = false;  // the last one names this server
    bool ended = false;        // the last one is that of a handover, to whomever

    /// `held`: the number of the last entry that the checkpoint covers; none up to it is kept.
    void add(transport::JournalMessage&& entry, transport::ClientId self, std::uint64_t held = 0);
    void forget_to(std::uint64_t number);
  };
  Journal journal_;  // of the epoch of the checkpoint
  Journal fresh_;    // of the live server, as long as the checkpoint is of one before
  bool asked_follows_ = false;
  std::vector<transport::Received<transport::JournalMessage>> entries_;
  std::vector<transport::Received<transport::CheckpointMessage>> parts_;
  std::vector<transport::Received<transport::AckMessage>> acknowledgements_;

  std::optional<transport::SessionMessage> announced_;
  std::optional<std::int64_t> due_since_ns_;  // since when there is a cause to take over
  std::int64_t told_ns_ = INT64_MIN / 2, status_ns_ = INT64_MIN / 2, refused_ns_ = INT64_MIN / 2;
  std::int64_t started_ns_ = 0;
  std::int64_t held_ns_ = 0;  // when checkpoint_ came
  std::uint64_t received_bytes_ = 0;
  std::int64_t newest_ns_ = 0;  // when the newest checkpoint came, or was last missed in the log
  bool news_ = false;           // something arrived that the live server should know
  std::int64_t wake_ns_ = 0;
  std::vector<Notice> notices_;
};

}  // namespace tandem::standby
