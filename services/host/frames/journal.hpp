#pragma once
// What servers that stand by need besides a checkpoint: each decision about an input, and each frame.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/wire/standby_messages.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/frames/frame_source.hpp"
#include "services/host/outgoing/outbox.hpp"

namespace tandem::host {

/// Numbers the entries and queues them. Nothing is kept or queued while it is closed. An entry that finds no
/// room in the outbox leaves a gap in the numbers, by which its readers know. Not thread-safe.
class Journal {
 public:
  /// Time between two entries where nothing happens.
  static constexpr std::int64_t kBeatNs = kSecond / 4;

  Journal(Epoch epoch, Outbox& outbox) : epoch_(epoch), outbox_(&outbox) {}

  void set_open(bool open);
  [[nodiscard]] bool open() const { return open_; }
  /// Notes a decision, whatever it is.
  void decided(const transport::InputMessage& input, const transport::ParticipantId& from,
               const InputVerdict& verdict);
  /// Queues the decisions that are noted; `next` is the frame whose step comes. Call it before a message
  /// that tells anybody of them, and often.
  void write(Frame next, std::int64_t now_ns);
  /// Queues that a frame was made, with its keys and events. Call it after write() and before the frame's
  /// deltas are queued.
  void made(Frame frame, std::uint64_t hash, std::span<const std::byte> news, std::int64_t now_ns);
  /// The same; the frame is the last one, and that server takes over. Then nothing may be queued any more,
  /// unless the session goes on here.
  void last(Frame frame, std::uint64_t hash, std::span<const std::byte> news, transport::ClientId standby,
            std::int64_t now_ns);
  /// Number of the last entry.
  [[nodiscard]] std::uint64_t number() const { return number_; }

 private:
  void push(transport::JournalMessage entry, std::int64_t now_ns);

  Epoch epoch_;
  Outbox* outbox_;
  bool open_ = false;
  std::uint64_t number_ = 0;
  std::int64_t pushed_ns_ = INT64_MIN / 2;
  std::vector<transport::InputDecision> noted_;
};

}  // namespace tandem::host
