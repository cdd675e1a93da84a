#pragma once
// tandem::Client: joins a session, holds its bodies bit-identically with the server, sends input, samples for
// rendering. Provisional: names may still change before 1.0.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tandem/body_shape.hpp"
#include "tandem/export.hpp"
#include "tandem/result.hpp"

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

struct ClientOptions {
  std::string session = "default";  ///< 1..64 characters of [A-Za-z0-9._-]
  std::uint32_t domain = 0;         ///< DDS domain, 0..230
  ClientRole role = ClientRole::kParticipant;
  std::uint32_t lead = 1;  ///< frames to simulate beyond the last delta; clamped to what the session allows
  /// True: a thread of the client's own does the work. False: the application calls poll() often (at least
  /// once a frame), and everything happens in there.
  bool background = true;
  /// One line for a human. Called from the thread that polls; must return soon, and must not call the client.
  std::function<void(LogLevel, std::string_view)> log;
};

/// Figures since connect(). Times in milliseconds, percentiles over all frames.
struct ClientStatus {
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
  std::uint32_t lead = 0;  ///< in force; lower than asked for when the session allows less
  std::uint64_t frames_applied = 0;
  std::uint64_t resyncs = 0;  ///< joins after the first one of an epoch
  std::uint64_t hash_mismatches = 0;
  std::uint64_t refused_messages = 0;  ///< bytes that broke a rule of the protocol
  std::uint64_t payload_bytes = 0;
  double mbit_per_s = 0;                          ///< of payload since the first frame; 2^20 bits to the Mbit
  double latency_ms_p50 = 0, latency_ms_p99 = 0;  ///< publish to applied; needs one clock for both hosts
  double input_latency_ms_p50 = 0,
         input_latency_ms_p99 = 0;              ///< sent until the frame it acted on was applied
  double client_ms_p50 = 0, client_ms_p99 = 0;  ///< decode, apply and simulate, a frame
  double join_ms = 0;  ///< last join: from learning of the session, or of the loss, to playing
  double round_trip_ms = 0, jitter_ms = 0;
  std::uint64_t inputs_sent = 0, inputs_acted = 0, inputs_refused = 0, inputs_unknown = 0;
  std::uint32_t queue_high_water = 0;  ///< deltas that waited at once, at most
};

struct BodyTypeInfo {
  std::string name;
  float radius = 0;               ///< of the sphere that holds the body; scene units
  std::uint32_t colour_rgba = 0;  ///< 0xRRGGBBAA
  BodyShape shape = BodyShape::kSphere;
  std::vector<float> shape_values = {};  ///< as the shape says
};

enum class BodyChange : std::uint8_t {
  kNone = 0,
  kNew = 1,     ///< was not there, or another body took its slot
  kGone = 2,    ///< was there in the previous sample
  kJumped = 3,  ///< the same body at another place: teleported, or this client had to join again
};

enum class SampleMode : std::uint8_t {
  kInterpolate = 0,  ///< between the last two agreed frames: always true, a frame late
  kExtrapolate = 1,  ///< at the server's time: predicted, with corrections blended in over about 0.1 s
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

/// One client of one session. Movable. All members may be called from any thread; all but sample() may have
/// to wait until the frame in work is applied.
class TANDEM_API Client {
 public:
  /// Starts looking for the session; returns at once, whether a server is there or not.
  /// Errors: kInvalidArgument (session name, domain, lead), kTransport (DDS could not start).
  [[nodiscard]] static Result<Client> connect(const ClientOptions& options);
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  /// Leaves the session; waits for the thread, if there is one.
  ~Client();

  /// Without a thread: takes what arrived, follows the session, and waits at most `wait_s` for something to
  /// do.
  void poll(double wait_s = 0);
  /// Lets the session go on for `seconds`: polls, or sleeps when a thread does the polling.
  void run_for(double seconds);
  [[nodiscard]] ClientStatus status() const;
  /// Blocks until playing, or `timeout_s` passed; returns whether it plays. Polls itself when there is no
  /// thread.
  bool wait_until_playing(double timeout_s);

  /// Sends an input and returns its number. It acts on the same frame everywhere; status() counts the
  /// outcome. Errors: kOutOfOrder while not playing or as an observer, kInvalidArgument (not finite, above
  /// 1,024 bytes), kTransport.
  [[nodiscard]] Result<std::uint64_t> send_gravity(std::array<double, 3> metres_per_s2);
  /// Adds `velocity` to the bodies within `radius` of `centre`; scene units.
  [[nodiscard]] Result<std::uint64_t> send_push(std::array<double, 3> centre, double radius,
                                                std::array<double, 3> velocity);
  /// Bytes for the engine.
  [[nodiscard]] Result<std::uint64_t> send_bytes(std::span<const std::byte> bytes);

  /// Body types of the session joined; empty before.
  [[nodiscard]] std::vector<BodyTypeInfo> types() const;
  /// The scene's geometry as protobuf text, for drawing; empty before a session is known.
  [[nodiscard]] std::string scene_description() const;
  /// The bodies as they should be drawn now, at any rate. Never changes what the client holds. Returns false,
  /// and leaves `out` as it is, before the first snapshot. Never waits for the network, for decoding or for
  /// applying, only for other calls of sample(); but the first call turns sampling on, and waits as the other
  /// members do. O(capacity); allocates when the capacity changed only.
  bool sample(Sample& out, SampleMode mode = SampleMode::kExtrapolate);

 private:
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem
