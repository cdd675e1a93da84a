#pragma once
// The plain types of tandem/client.hpp: what a client tells about itself and about the bodies.

#include <cstdint>
#include <string>
#include <vector>

#include "tandem/client_figures.hpp"

namespace tandem {

/// A participant may send input, and within limits the server waits for it. An observer only watches.
enum class ClientRole : std::uint8_t { kObserver = 0, kParticipant = 1 };

enum class ClientPhase : std::uint8_t {
  kSearching = 0,  ///< has not seen a live server of that session
  kRefused = 1,    ///< cannot play the session that is there; `ClientStatus::reason` says why
  kJoining = 2,    ///< waiting for a snapshot
  kPlaying = 3,    ///< holds the agreed state and follows it
};

enum class LogLevel : std::uint8_t { kInfo = 0, kWarning = 1, kError = 2 };

/// The state of a client, and its figures.
struct ClientStatus : ClientFigures {
  ClientPhase phase = ClientPhase::kSearching;
  ClientRole role = ClientRole::kObserver;  ///< as granted by the server
  std::uint64_t client_id = 0;
  bool server_alive = false;
  std::string reason;  ///< why role or phase is not as requested; empty if it is
  std::string scene;
  std::uint64_t epoch = 0;       ///< one run of a server; 0 before the first
  std::uint64_t frame = 0;       ///< last frame agreed with the server
  std::uint64_t state_hash = 0;  ///< of that frame
  double frame_rate_hz = 0;
  std::uint32_t lead = 0;     ///< in force; lower than requested if the session allows less
  std::string stream;         ///< the stream that is played or joined: its name, or its number if it has no
                              ///< name
  std::string stream_reason;  ///< why this stream was chosen, for a human
};

/// Calls visit("name", that member of each of `of`) for all members of ClientStatus and tandem_status that
/// are not figures.
template <class Visit, class... Of>
constexpr void each_client_state(const Visit& visit, Of&... of) {
  visit("phase", of.phase...);
  visit("role", of.role...);
  visit("client_id", of.client_id...);
  visit("server_alive", of.server_alive...);
  visit("reason", of.reason...);
  visit("scene", of.scene...);
  visit("epoch", of.epoch...);
  visit("frame", of.frame...);
  visit("state_hash", of.state_hash...);
  visit("frame_rate_hz", of.frame_rate_hz...);
  visit("lead", of.lead...);
  visit("stream", of.stream...);
  visit("stream_reason", of.stream_reason...);
}

enum class BodyChange : std::uint8_t {
  kNone = 0,
  kNew = 1,     ///< the body was not there before, or another body took its slot
  kGone = 2,    ///< the body was there in the previous sample
  kJumped = 3,  ///< the same body at another place: it was teleported, or the client rejoined
};

enum class SampleMode : std::uint8_t {
  kInterpolate = 0,  ///< between the last two agreed frames: exact, but one frame late
  kExtrapolate = 1,  ///< at the server's time: predicted, with corrections blended in over about 0.05 s
};

/// The bodies at one moment, to draw. Arrays have `capacity` elements; positions have three for each slot (x,
/// y, z of slot 0, of slot 1, ...), orientations four. For slots with alive == 0 only `changes` is specified.
struct Sample {
  std::uint64_t epoch = 0;
  double frame = 0;  ///< the moment, in frames
  std::uint32_t capacity = 0;
  std::vector<float> positions;  ///< scene units
  /// Quaternions x, y, z, w (Eigen's order) of norm 1, from the body's frame to the world's. q and -q are the
  /// same orientation; a body's value may change from one to the other between samples. Empty if the session
  /// has no orientations: its bodies are points.
  std::vector<float> orientations;
  std::vector<std::uint8_t> alive;
  std::vector<std::uint8_t> generation;
  std::vector<std::uint16_t> types;  ///< index into Client::types()
  std::vector<BodyChange> changes;   ///< changes since the previous sample() of this client
};

}  // namespace tandem
