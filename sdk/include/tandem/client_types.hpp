#pragma once
// What a client tells about itself and about the bodies: the plain types of tandem/client.hpp.

#include <cstdint>
#include <string>
#include <vector>

#include "tandem/client_figures.hpp"

namespace tandem {

/// A participant may send input and the server waits for it, within limits; an observer only watches.
enum class ClientRole : std::uint8_t { kObserver = 0, kParticipant = 1 };

enum class ClientPhase : std::uint8_t {
  kSearching = 0,  ///< no live server of that session seen
  kRefused = 1,    ///< a session is there, but this client cannot play it; `ClientStatus::reason` says why
  kJoining = 2,    ///< waiting for a snapshot
  kPlaying = 3,    ///< holds the agreed state and follows it
};

enum class LogLevel : std::uint8_t { kInfo = 0, kWarning = 1, kError = 2 };

/// How a client stands, and its figures.
struct ClientStatus : ClientFigures {
  ClientPhase phase = ClientPhase::kSearching;
  ClientRole role = ClientRole::kObserver;  ///< as granted by the server
  std::uint64_t client_id = 0;
  bool server_alive = false;
  std::string reason;  ///< why the role or the phase is not what was asked for; empty when it is
  std::string scene;
  std::uint64_t epoch = 0;       ///< of the server's run; 0 before the first
  std::uint64_t frame = 0;       ///< last frame agreed with the server
  std::uint64_t state_hash = 0;  ///< of that frame
  double frame_rate_hz = 0;
  std::uint32_t lead = 0;     ///< in force; lower than asked for when the session allows less
  std::string stream;         ///< that is played or joined: its name, or its number
  std::string stream_reason;  ///< why that one, for a human
};

/// Calls visit("name", that member of each of `of`) for what ClientStatus and tandem_status have besides
/// figures.
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
  kNew = 1,     ///< was not there, or another body took its slot
  kGone = 2,    ///< was there in the previous sample
  kJumped = 3,  ///< the same body at another place: teleported, or this client had to join again
};

enum class SampleMode : std::uint8_t {
  kInterpolate = 0,  ///< between the last two agreed frames: always true, a frame late
  kExtrapolate = 1,  ///< at the server's time: predicted, with corrections blended in over about 0.05 s
};

/// The bodies at one moment, to draw. Arrays are `capacity` long, positions three times that (x, y, z of slot
/// 0, of slot 1, ...), orientations four times. Values of slots with alive == 0 are unspecified, except their
/// `change`.
struct Sample {
  std::uint64_t epoch = 0;
  double frame = 0;  ///< the moment, in frames
  std::uint32_t capacity = 0;
  std::vector<float> positions;  ///< scene units
  /// Quaternions x, y, z, w (Eigen's order) of norm 1, from the body's frame to the world's. q and -q are the
  /// same orientation, and a body's may change from one to the other between samples. Empty where the session
  /// has no orientations: its bodies are points.
  std::vector<float> orientations;
  std::vector<std::uint8_t> alive;
  std::vector<std::uint8_t> generation;
  std::vector<std::uint16_t> types;  ///< index into Client::types()
  std::vector<BodyChange> changes;   ///< against the previous sample() of this client
};

}  // namespace tandem
