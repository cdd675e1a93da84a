#pragma once
// tandem::Server: streams a simulation of yours to any number of clients. Implement engine::Simulation
// (tandem/simulation.hpp), start a server on it, poll it.
//
//     MySimulation simulation;
//     auto server = tandem::Server::start({.session = "mine", .threshold = 0.005, .extent = 50}, simulation);
//     if (!server) return complain(server.error().message);
//     while (server->poll()) {}
//
// EXPERIMENTAL: names may still change before 1.0; link it from the version it was built with.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tandem/body_shape.hpp"
#include "tandem/result.hpp"
#include "tandem/scenery.hpp"
#include "tandem/server_figures.hpp"
#include "tandem/simulation.hpp"

namespace tandem {

/// What clients draw for one type of body.
struct ServedType {
  std::string name = "body";  ///< 1..64 bytes
  double radius = 0.5;        ///< of the sphere around a body; scene units
  std::uint32_t colour_rgba = 0xC0C0C0FF;
  BodyShape shape = BodyShape::kSphere;
  std::vector<float> shape_values = {};  ///< as the shape says
  double mass = 1;                       ///< > 0; matters beside other types, and with Scenery's laws
  /// Of the sphere that `contact` and `field` take a body for; 0: `radius`.
  double contact_radius = 0;
};

struct ServerOptions {
  std::string session = "default";  ///< 1..64 characters of [A-Za-z0-9._-]
  std::uint32_t domain = 0;         ///< DDS domain, 0..230
  /// Largest distance between where the simulation and where the clients have a body, or a point of its
  /// surface where bodies turn; scene units. The price of a frame grows as it shrinks.
  double threshold = 0.01;
  /// Largest |coordinate| that a body reaches; scene units. Who goes further disappears, which the log tells,
  /// until the simulation despawns, spawns or teleports it (engine::Event). At most about a million
  /// thresholds.
  double extent = 100;
  /// Payload that the server keeps to by itself, Mbit/s (2^20 bits), with errors of up to `max_error`; 0:
  /// `threshold` alone decides.
  double target_mbit_per_s = 0;
  /// Threshold and quantisation steps follow the bodies at run time, from a quarter of `threshold` up to
  /// `max_error`; a target implies it.
  bool automatic_threshold = false;
  double max_error = 0;           ///< with an automatic threshold; scene units; 0: four thresholds
  std::string codec = "tracker";  ///< or none, selective, quantized, entropy, limited
  /// The predicted step of server and clients: ballistic (bodies fly until they are corrected), contact and
  /// field (they meet each other and the scenery), or auto: with codec tracker, scenery, and at most 50,000
  /// spheres of about one size a stream `thin` of ballistic and one, `rich`, of field, else ballistic.
  std::string predictor = "auto";
  std::optional<Scenery> scenery = {};  ///< what contact and field compute with; empty: they are not there
  std::size_t budget_bytes =
      0;  ///< of corrections a frame, with codec limited or tracker; 0: the codec's usual
  /// Up to 8 ways of telling the world, each for clients of other means, as tandemd's --stream says them:
  /// NAME:PREDICTOR, or NAME:key=value,... with codec, predictor, threshold, target-bandwidth, max-error,
  /// budget. What is left out comes from the options above. Each is made while somebody plays it. Empty: as
  /// `predictor` says.
  std::vector<std::string> streams = {};
  std::uint32_t lead = 1;     ///< frames that clients may simulate beyond the last delta, 0 or 1
  std::uint32_t threads = 1;  ///< of the codec, 1..64; more help with tens of thousands of bodies
  /// By what Simulation::bodies() calls type; at least one, at most 65,535.
  std::vector<ServedType> types{ServedType{}};
  std::string scene = "";  ///< a name to show, at most 64 bytes
  /// Geometry for clients to draw, as protobuf text of idl/scene.proto: planes, boxes, spheres, bounds. What
  /// clients could not read is refused, with its line.
  std::string scene_description = "";
  std::uint32_t wait_for = 0;        ///< participants that must play before frame 1
  std::uint32_t client_limit = 256;  ///< clients at once
  /// Frames the server may run ahead of its slowest participant, 1..24; empty: from measured round trips.
  std::optional<std::uint32_t> window = {};
  /// Seconds that a participant may hold up the others within 10 s, 0.01..10, before it only watches; empty:
  /// for ever.
  std::optional<double> stall_timeout_s = 0.5;
  double rate_hz = 0;      ///< frames a second, 1..1000; 0: the simulation's own, 1 / dt_s
  bool free_rate = false;  ///< as fast as participants and network allow, instead
  /// One line for a human: who joined, was demoted, refused. Called by poll(); must not call the server.
  std::function<void(std::string_view)> log = {};
};

/// How a server stands, and its counts since the start.
struct ServerStatus : ServerCounts {
  std::uint64_t frame = 0;                        ///< of the last delta
  std::uint64_t state_hash = 0;                   ///< of that frame, as every client has it
  std::uint32_t participants = 0, observers = 0;  ///< playing now
  std::uint64_t payload_bytes = 0, corrected = 0;
  double threshold = 0;                       ///< in force
  double frame_ms_p50 = 0, frame_ms_p99 = 0;  ///< step, predict, encode, apply
};

/// One server of one session, at the simulation's rate (1 / dt_s) or the one that options say. Movable; what
/// it was moved from has ended (kOutOfOrder). All members from one thread, which is the one that calls the
/// simulation; a thread of the server's own does the sending.
class __attribute__((visibility("default"))) Server {
 public:
  /// `simulation` must outlive the server; it was not stepped yet, and its bodies now are the start frame.
  /// Errors: kInvalidArgument (options, or body columns not `capacity` long), kUnsupported (codec,
  /// predictor), kTransport (DDS could not start).
  [[nodiscard]] static Result<Server> start(const ServerOptions& options, engine::Simulation& simulation);
  Server(Server&&) noexcept;
  Server& operator=(Server&&) noexcept;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  /// Ends the session; what was queued is sent first. Where the network interface is gone, the end of DDS
  /// does not return: tandem/tandem.h says at tandem_leave() what an application can do.
  ~Server();

  /// Does what is due, which may be a step of the simulation, and waits at most `wait_s`, 0..1, for the next
  /// thing. What is below the range or no number counts as 0, what is above it as 1. False once the session
  /// cannot go on: see error(). False too, doing nothing (kOutOfOrder), where the simulation or the log calls
  /// it inside a poll(); the outer one goes on.
  bool poll(double wait_s = 0.05);
  /// Polls for so long, or until the session cannot go on; returns as poll(). What is negative or no number
  /// counts as 0: then it does nothing.
  bool run_for(double seconds);
  /// kConflict: another server has the session. kTransport: a frame could not be written for 10 s.
  /// kInvalidArgument: the simulation's body columns are not `capacity` long any more.
  [[nodiscard]] const Error& error() const;

  /// An input of the server's own, as if a participant had sent it now; returns the frame it acts on.
  /// Errors: kInvalidArgument (refused by the simulation), kCapacity (too many at once), kOutOfOrder (moved
  /// from).
  Result<std::uint64_t> inject(const engine::Input& input);
  [[nodiscard]] ServerStatus status() const;

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem
