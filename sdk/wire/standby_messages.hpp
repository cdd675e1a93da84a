#pragma once
// The messages between a live server, the servers that stand by, and operators: idl/PROTOCOL.md, "Standby".

#include <cstdint>
#include <string>
#include <vector>

#include "sdk/wire/messages.hpp"

namespace tandem::transport {

/// What became of one input, with all that is needed to apply it again.
struct InputDecision {
  ClientId client = 0;  ///< 0: the server itself
  std::uint64_t number = 0;
  ClientId origin = 0;
  Frame frame = 0;              ///< the frame that it acts on, if code is kNone
  std::uint64_t scheduled = 0;  ///< number of its scheduled input; 0: it acts at once, or not at all
  std::uint32_t code = 0;       ///< Reason
  std::uint32_t kind = 0;
  Bytes participant;  ///< 16 bytes: ParticipantId of the client
  std::vector<double> values;
  Bytes bytes;
  bool operator==(const InputDecision&) const = default;
};

enum class JournalState : std::uint32_t {
  kNotMade = 0,
  kMade = 1,
  kLast = 2,  ///< made, and the server hands over: it makes no further frame
};

/// What a server decided before the step to a frame, and whether it made the frame.
struct JournalMessage {
  static constexpr const char* kTopic = "TandemJournal";
  Epoch epoch = 0;
  std::uint64_t number = 0;  ///< 1, 2, ... in this epoch
  Frame frame = 0;
  ClientId successor = 0;  ///< kLast: the server that takes over
  std::uint64_t hash = 0;  ///< hash of the bodies on the lattice at that frame; 0 unless it was made
  JournalState state = JournalState::kNotMade;
  std::vector<InputDecision> decisions;  ///< in the order in which they were made
  Bytes news;                            ///< of the frame, for all clients
  bool operator==(const JournalMessage&) const = default;
};

/// A part of a checkpoint (services/host/checkpoint/README.md).
struct CheckpointMessage {
  static constexpr const char* kTopic = "TandemCheckpoint";
  Epoch epoch = 0;
  Frame frame = 0;
  std::uint64_t journal = 0;  ///< number of the last journal entry that the checkpoint contains
  std::uint32_t part = 0, parts = 1;
  std::uint32_t total_bytes = 0;
  Bytes bytes;
  bool operator==(const CheckpointMessage&) const = default;
};

/// What a server that stands by holds.
struct StandbyMessage {
  static constexpr const char* kTopic = "TandemStandby";
  ClientId standby = 0;  ///< key; random, never 0
  Epoch epoch = 0;       ///< that it follows
  Frame holds_frame = 0;
  std::uint64_t journal = 0;  ///< number of the last journal entry that it has, without a gap
  Frame part_frame = 0;       ///< of the checkpoint that it is receiving
  std::uint32_t part_count = 0;
  std::uint32_t protocol_version = kProtocolVersion;
  std::uint32_t rank = 1;
  std::vector<std::uint32_t> missing;  ///< as in AckMessage
  bool operator==(const StandbyMessage&) const = default;
};

enum class CommandKind : std::uint32_t { kHandOver = 1 };

/// An operator's wish.
struct CommandMessage {
  static constexpr const char* kTopic = "TandemCommand";
  Epoch epoch = 0;
  std::uint64_t request = 0;  ///< random; each is obeyed once
  CommandKind kind = CommandKind::kHandOver;
  std::string session;  ///< key
  bool operator==(const CommandMessage&) const = default;
};

}  // namespace tandem::transport
