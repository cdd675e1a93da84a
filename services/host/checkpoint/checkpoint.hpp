#pragma once
// All that a server needs to go on from a frame, as plain values.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/core/layout/parameters.hpp"
#include "sdk/wire/messages.hpp"
#include "tandem/simulation.hpp"

namespace tandem::checkpoint {

/// An epoch modulo this says who began it, so that two servers whose clocks agree do not begin the same one:
/// 0 for a server that started, 1 to 7 by rank for one that took over.
inline constexpr Epoch kBeginners = 8;
/// Larger epochs are no milliseconds, and clients that count in doubles would confuse larger frames.
inline constexpr std::uint64_t kLastEpoch = std::uint64_t{1} << 53U, kLastFrame = kLastEpoch;
/// The epoch near `about` that such a server begins.
[[nodiscard]] constexpr Epoch begun_by(Epoch beginner, Epoch about) {
  return about / kBeginners * kBeginners + beginner;
}

/// A scheduled input that was issued and has not acted yet.
struct Scheduled {
  std::uint64_t number = 0;
  Frame frame = 0;  ///< the frame that it acts on
  engine::Input input;
};

/// A stream as it was told after the frame.
struct StreamState {
  std::string name;
  std::uint64_t layout_hash = 0;
  std::uint32_t generation = 0;
  StreamParameters parameters;  ///< of the next frame
};

/// What a client was told of its inputs.
struct ClientState {
  transport::ClientId id = 0;
  transport::ParticipantId from;
  std::uint64_t highest = 0;                    ///< highest input number that was decided
  std::vector<transport::ReplyEntry> outcomes;  ///< at most transport::kReplyRing, oldest first
};

/// A world right after a frame. A vector keeps its memory when another checkpoint is put into it.
struct Checkpoint {
  std::string session, scene;
  std::string engine;   ///< name of the engine; empty if it has none
  std::string program;  ///< version of the build that wrote it
  Epoch epoch = 0;
  Frame frame = 0;
  std::int64_t wall_ms = 0;  ///< time of day at the frame
  double dt_s = 0;
  double lattice_unit = 0;
  engine::Vec3 gravity{};  ///< the drive in force, scene units / s^2
  double damping_per_s = 0;
  std::uint32_t bodies = 0;  ///< alive, as clients saw them
  std::vector<std::string> types;

  std::vector<std::uint8_t>
      next_reuse;  ///< by slot: `reuse` of its next body; a slot for each of the capacity
  std::vector<std::uint8_t>
      withheld;  ///< by slot: 1 if the engine has a body there that clients must not see
  std::vector<StreamState> streams;
  std::uint64_t last_input = 0;          ///< number of the last scheduled input that was issued
  std::vector<Scheduled> scheduled;      ///< consecutive numbers up to last_input, ascending by frame
  std::vector<engine::Input> immediate;  ///< inputs of the next frame, in the order of arrival
  /// Inputs of the frame after that. Only a takeover has them, if the live server ended while a step was
  /// under way; no file does.
  std::vector<engine::Input> later;
  /// Keys and events up to the frame, and what no frame has told yet: NewsDesk::save(). Empty where the
  /// session has neither.
  std::vector<std::byte> world, waiting_news;
  std::vector<ClientState> clients;
  std::uint64_t journal = 0;  ///< number of the last journal entry before the frame was over; not in the file
  std::vector<std::byte> engine_state;  ///< of Simulation::save()

  [[nodiscard]] std::uint32_t capacity() const { return static_cast<std::uint32_t>(next_reuse.size()); }
};

}  // namespace tandem::checkpoint
