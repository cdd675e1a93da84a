#pragma once
// The servers that stand by for a live one.

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "sdk/wire/port.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/accounts/passage.hpp"
#include "services/host/checkpoint/writer.hpp"
#include "services/host/clients/notices.hpp"
#include "services/host/outgoing/outbox.hpp"

namespace tandem::host {

/// Knows who stands by, and sends each of them the newest checkpoint, one after the other. Messages are
/// untrusted. Not thread-safe.
class Standbys {
 public:
  static constexpr std::size_t kMaxStandbys = 8;
  static constexpr std::size_t kPartBytes = 16'000;
  static constexpr std::size_t kMaxStoodBy = 64;
  /// A server that says nothing for so long does not stand by any more.
  static constexpr std::int64_t kSilentNs = 3 * kSecond;

  /// A server that stands by, as far as the live one knows it.
  struct KnownStandby {
    transport::ClientId id = 0;
    transport::ParticipantId from;
    std::uint32_t rank = 1;
    Frame holds_frame = 0;      ///< of its last whole checkpoint of this epoch; 0: none
    std::uint64_t journal = 0;  ///< number of the last entry that it has
    std::int64_t heard_ns = 0;
    bool follows = false;  ///< it reads the journal and checkpoints
    bool told = false;     ///< the log says that it is ready
  };

  Standbys(Epoch epoch, Outbox& outbox) : epoch_(epoch), outbox_(&outbox) {}

  void heard(const transport::Received<transport::StandbyMessage>& message, Notices& notices,
             std::int64_t now_ns);
  /// Call often: looks who reads by now, and forgets who is silent.
  void look(transport::ServerPort& port, Notices& notices, std::int64_t now_ns);
  /// True if somebody follows: journal and checkpoints are needed.
  [[nodiscard]] bool any() const;
  /// Gives a new checkpoint to all whose last one has arrived.
  void offer(const std::shared_ptr<const checkpoint::Encoded>& checkpoint, std::int64_t now_ns);
  /// Queues the parts that windows and outbox have room for.
  void send(std::int64_t now_ns);
  /// When send() may have something to do that it does not have now.
  [[nodiscard]] std::int64_t next_ns() const { return next_ns_; }
  /// The server of the lowest rank that holds a checkpoint and was heard in the last second; null: none.
  [[nodiscard]] const KnownStandby* first_ready(std::int64_t now_ns) const;
  [[nodiscard]] const KnownStandby* find(transport::ClientId id) const;
  /// True if a server of that participant has stood by and held a checkpoint of this epoch, also long ago: it
  /// is one of the last kMaxStoodBy of them.
  [[nodiscard]] bool may_succeed(const transport::ParticipantId& participant) const {
    return std::ranges::find(stood_by_, participant) != stood_by_.end();
  }
  [[nodiscard]] std::size_t count() const { return standbys_.size(); }
  /// Bytes queued since the start, repetitions too.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  struct Sending {
    std::shared_ptr<const checkpoint::Encoded> checkpoint;
    accounts::Passage passage;
  };
  struct Served : KnownStandby {
    std::optional<Sending> sending;
    Frame offered = 0;  // of the newest checkpoint that it was sent
  };
  [[nodiscard]] bool has_seat(const transport::Received<transport::StandbyMessage>& message, Notices& notices,
                              std::int64_t now_ns);
  [[nodiscard]] bool serve(Served& standby, std::int64_t now_ns);

  Epoch epoch_;
  Outbox* outbox_;
  std::map<transport::ClientId, Served> standbys_;
  std::vector<transport::ParticipantId> stood_by_;  // who was heard last is the last
  std::int64_t told_full_ns_ = INT64_MIN / 2;
  std::int64_t looked_ns_ = INT64_MIN / 2;
  std::int64_t next_ns_ = INT64_MAX;
  std::uint64_t bytes_ = 0;
};

}  // namespace tandem::host
