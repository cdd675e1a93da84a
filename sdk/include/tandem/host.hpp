#pragma once
// tandem::Server: streams your simulation to any number of clients. Implement engine::Simulation
// (tandem/simulation.hpp), start a server on it, poll it.
//
//     MySimulation simulation;
//     auto server = tandem::Server::start({.session = "mine", .threshold = 0.005, .extent = 50}, simulation);
//     if (!server) return complain(server.error().message);
//     while (server->poll()) {}
//
// Or, if your own loop steps the simulation, hand over its columns (tandem::HandedColumns, at the end).
//
// EXPERIMENTAL: names may still change before 1.0. Link the library of the same version as this header.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
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
  std::vector<float> shape_values = {};  ///< see BodyShape
  double mass = 1;                       ///< > 0; used for contacts between types, and with Scenery's laws
  /// Radius of the sphere that stands for a body in `contact`, `field` and `hard`; 0: `radius`.
  double contact_radius = 0;
};

struct ServerOptions {
  std::string session = "default";  ///< 1..64 characters of [A-Za-z0-9._-]
  std::uint32_t domain = 0;         ///< DDS domain, 0..230
  /// Folder of the server's identity for DDS Security, made by `tandem pki issue server`. Empty: none, and
  /// everybody on the network can join.
  std::string secure = "";
  /// The kind of network, "NAME" or "NAME:key=value,..." (deploy/dds). Empty: CYCLONEDDS_URI decides. A
  /// process that also has clients on the domain starts its server first, and they have the same profile.
  std::string profile = {};
  /// Maximum distance between a body's position in the simulation and at the clients; if bodies turn, between
  /// the two positions of any point of its surface. Scene units. A smaller threshold makes a frame larger.
  double threshold = 0.01;
  /// Maximum |coordinate| of a body; scene units. Clients do not see a body that is further away, or not
  /// finite, and the log says so; when it is back, it is another body to them. The maximum is about a million
  /// thresholds: subtract an origin from places on a map.
  double extent = 100;
  /// Payload rate that the server holds by choosing the error itself, up to `max_error`; Mbit/s (2^20 bits).
  /// 0: `threshold` alone decides.
  double target_mbit_per_s = 0;
  /// Threshold and quantisation steps follow the bodies at run time, from a quarter of `threshold` up to
  /// `max_error`; a target implies it.
  bool automatic_threshold = false;
  double max_error = 0;           ///< with an automatic threshold; scene units; 0: four thresholds
  std::string codec = "tracker";  ///< or none, selective, quantized, entropy, limited
  /// The predicted step of server and clients: ballistic (bodies fly until they are corrected), contact and
  /// field (bodies also meet each other and the scenery), hard (likewise, for simulations whose spheres do
  /// not give way), rigid (the same for bodies that turn), or auto. auto publishes two streams if the codec
  /// is tracker, there is scenery, and there are at most 1,048,576 spheres of about one size: `thin` with
  /// ballistic and, while it pays, `rich` with field. Otherwise it uses ballistic. It measures hard, or rigid
  /// for at most 4,000 other bodies that turn, and publishes it too where it saves a quarter.
  std::string predictor = "auto";
  /// What contact, field and hard compute with; empty: they are not available. hard ignores the laws.
  std::optional<Scenery> scenery = {};
  /// Maximum size of the corrections of a frame, with codec limited or tracker; 0: the codec's default.
  std::size_t budget_bytes = 0;
  /// Maximum times for which small frames are collected, so that they share packets, 0..1 s; clients draw the
  /// world so much later. A frame on which an input acted does not wait. Each stream is encoded once and
  /// offered in each of one or two delays: observers take the one, participants the other. Empty: 0 and 0.2,
  /// or 0 alone where that would be more than eight offers.
  std::vector<double> delivery_delays_s = {};
  /// Publishes the same world as up to eight streams, for clients with different processors and links. The
  /// form is that of tandemd's --stream: NAME:PREDICTOR, or NAME:key=value,... with the keys codec,
  /// predictor, threshold, target-bandwidth, max-error, budget, delay, cap, data (yes or no), data_kbit_s.
  /// Keys that are left out come from the options above. A stream is computed only while a client plays it;
  /// without clients only the first is. Empty: as `predictor` says.
  std::vector<std::string> streams = {};
  std::uint32_t lead = 1;     ///< frames that clients may simulate beyond the last delta, 0 or 1
  std::uint32_t threads = 1;  ///< threads of the codec, 1..64; more than one helps with tens of thousands of
                              ///< bodies
  /// Indexed by the `type` column of Simulation::bodies(); 1 to 65,535 types.
  std::vector<ServedType> types{ServedType{}};
  std::string scene = "";  ///< a name to display, at most 64 bytes
  /// Geometry for clients to draw, as JSON: the message Scene of idl/scene.proto in protobuf's JSON mapping,
  /// with planes, boxes, spheres, bounds: {"planes": [{"normal": {"y": 1}}]}. start() refuses what clients
  /// could not read, and says what is wrong. Empty: `scenery` is drawn.
  std::string scene_json = "";
  std::uint32_t up_axis = 1;         ///< the axis that points up: 0 x, 1 y, 2 z
  std::uint32_t wait_for = 0;        ///< participants that must play before frame 1
  std::uint32_t client_limit = 256;  ///< maximum number of clients at once
  /// Maximum number of frames that the server runs ahead of its slowest participant, 1..24; empty: chosen
  /// from measured round trips.
  std::optional<std::uint32_t> window = {};
  /// Seconds within 10 s that a participant may hold up the others before it becomes an observer, 0.01..10;
  /// empty: no limit.
  std::optional<double> stall_timeout_s = 0.5;
  /// What the session tells beside bodies: Server::set_key(), Server::broadcast(). It has what the simulation
  /// tells() besides. A session without pays nothing for them, and clients of other builds may not know them.
  bool keys = false, events = false;
  /// The data that each body has beside its motion, in engine::Bodies::data: up to 16 fields of together 16
  /// bytes at most, each a kind (u8, i8, u16, i16, u32, i32, f32, rgba) and a name of a-z, 0-9 and '_':
  /// "u8 health, f32 heat, rgba colour". Clients find a field by its name, and get each change without loss
  /// on its frame. Empty: none.
  std::string data = "";
  double rate_hz = 0;      ///< frames a second, 1..1000; 0: the simulation's own, 1 / dt_s
  bool free_rate = false;  ///< ignores the rate and runs as fast as participants and network allow
  /// A folder for checkpoints of this session alone; its parent must exist. Empty: no checkpoints. The server
  /// writes one every `checkpoint_interval_s` and goes on from the newest when it is started again: start()
  /// then calls Simulation::load() of the simulation that it is given. Without a good checkpoint it starts
  /// afresh and says so in the log. The simulation needs save() and load(); a server of one without them has
  /// no checkpoints, and says so.
  std::string checkpoint_dir = "";
  double checkpoint_interval_s = 1;  ///< 0.01..86400
  bool checkpoint_required = false;  ///< start() fails where there is no good checkpoint
  /// Receives one line for a human, for example when a client joins, is demoted or is refused. Called by
  /// poll(). It must not call the server.
  std::function<void(std::string_view)> log = {};
};

/// The state of a server, and its counts since the start.
struct ServerStatus : ServerCounts {
  std::uint64_t frame = 0;                        ///< of the last delta
  std::uint64_t state_hash = 0;                   ///< state hash of that frame, the same at every client
  std::uint32_t participants = 0, observers = 0;  ///< playing now
  std::uint64_t payload_bytes = 0, corrected = 0;
  double threshold = 0;                       ///< in force
  double frame_ms_p50 = 0, frame_ms_p99 = 0;  ///< step, predict, encode, apply
  /// The epoch and the frame of it that this session continues from a checkpoint; 0, 0: it started afresh.
  std::uint64_t continues_epoch = 0, continues_frame = 0;
  std::uint64_t checkpoints = 0;           ///< written since the start
  std::optional<double> checkpoint_age_s;  ///< since the frame of the last one; empty: none was written
  std::uint32_t hidden = 0;                ///< bodies that clients do not see: see ServerOptions::extent
};

/// One server of one session. It runs at the simulation's rate (1 / dt_s) or at the rate in the options.
/// Movable; a moved-from server has ended (kOutOfOrder). Call all members from one thread; that thread calls
/// the simulation. The server has a thread of its own for sending.
class __attribute__((visibility("default"))) Server {
 public:
  /// Starts a server. `simulation` must outlive the server. It must not have been stepped; its bodies are the
  /// start frame, unless there is a checkpoint. Errors: kInvalidArgument (options, or body columns not
  /// `capacity` long), kUnsupported (codec, predictor; a checkpoint is required, but the simulation has no
  /// save()), kTransport (DDS could not start), kConflict (another server holds the folder of checkpoints),
  /// kIo (that folder; no good checkpoint, but one is required; the simulation threw an exception).
  [[nodiscard]] static Result<Server> start(const ServerOptions& options, engine::Simulation& simulation);
  Server(Server&&) noexcept;
  Server& operator=(Server&&) noexcept;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  /// Ends the session after sending what was queued. If the network interface is gone, DDS does not stop and
  /// the destructor does not return; tandem_leave() in tandem/tandem.h says what an application can do.
  ~Server();

  /// Does what is due, which may be a step of the simulation, and waits at most `wait_s` for the next thing
  /// to do. `wait_s` is 0..1; values below or not a number count as 0, values above as 1. Returns false if
  /// the session cannot go on: see error(). If the simulation or the log calls it inside a poll(), it does
  /// nothing and returns false (kOutOfOrder); the outer call goes on.
  bool poll(double wait_s = 0.05);
  /// Polls for `seconds`, or until the session cannot go on; returns as poll(). A negative value or one that
  /// is not a number counts as 0: the function then does nothing.
  bool run_for(double seconds);
  /// kConflict: another server has the session. kTransport: a frame could not be written for 10 s.
  /// kInvalidArgument: the simulation's body columns are not `capacity` long any more. kIo: the simulation
  /// threw an exception, or says its failure().
  [[nodiscard]] const Error& error() const;

  /// Applies an input of the server as if a participant had sent it now. Returns the frame that it acts on.
  /// Errors: kInvalidArgument (refused by the simulation), kCapacity (too many at once), kOutOfOrder (moved
  /// from).
  Result<std::uint64_t> inject(const engine::Input& input);
  [[nodiscard]] ServerStatus status() const;

  // Keys and events, with ServerOptions::keys and ::events. Unlike the others, these three may be called from
  // any thread, and by the simulation in its step: then the frame of that step tells them. Otherwise the next
  // frame does.

  /// Gives a key of the session a value: score, phase of the game, weather. Clients have the latest value
  /// from that frame on, also those that join later; a frame tells each key once. At most 256 keys of 1 to 64
  /// characters of ASCII without control characters, together with their values at most 65,536 bytes. Errors:
  /// kUnsupported (no such option), kInvalidArgument (the key), kCapacity, kOutOfOrder (moved from).
  Result<void> set_key(std::string_view key, std::span<const std::byte> value);
  /// Removes a key, if it is there. Errors: as set_key().
  Result<void> remove_key(std::string_view key);
  /// Tells every client that plays, once and with its frame, that something happened. Who joins later is not
  /// told. `kind`: below 2^31; what it means is the application's. At most 1,024 bytes. `slot`: the body that
  /// it is about, if there is one. A frame tells 64 events and 16 KiB at most; up to 1,024 wait for the next
  /// ones, and more are refused. A frame with an event is not collected with others, ten times a second at
  /// most. Errors: kUnsupported (no such option), kInvalidArgument, kCapacity (too many wait), kOutOfOrder
  /// (moved from).
  Result<void> broadcast(std::uint32_t kind, std::span<const std::byte> bytes = {},
                         std::optional<std::uint32_t> slot = {});

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// What a loop of its own that hands over columns says of itself.
struct HandedColumnsOptions {
  std::uint32_t capacity = 0;  ///< slots, 1..engine::kMaxBodies
  double dt_s = 1.0 / 60;      ///< seconds from one frame to the next
  bool turns = false;          ///< bodies have orientations
  std::size_t data_bytes = 0;  ///< size of a body's record in ServerOptions::data, 0..16
  engine::Vec3 gravity{};      ///< in force at the start; clients predict with it
  double damping_per_s = 0;
  // The largest inputs that the loop takes: length of gravity, length of a push's change of velocity, bytes.
  // Empty: none of that kind.
  std::optional<double> most_gravity = {}, most_push = {};
  std::optional<std::size_t> most_bytes = {};
  /// Both or none; with them there are checkpoints. load() fills the columns, or returns false and changes
  /// nothing. They are called between hand_over() and the next wanted().
  std::function<std::vector<std::byte>()> save = {};
  std::function<bool(std::span<const std::byte>)> load = {};
};

/// A simulation that is not stepped by the server, but hands over its columns when they are there:
///
///     tandem::HandedColumns columns({.capacity = 1000, .most_push = 50});
///     fill(columns);                                             // the start frame
///     auto server = tandem::Server::start(options, columns);
///     while (server->poll()) {
///       if (!columns.wanted()) continue;
///       for (const tandem::engine::Input& input : columns.take_inputs()) act(input);
///       compute();
///       fill(columns);
///       columns.hand_over();
///     }
///
/// The server paces the loop: it wants a frame when one is due, and goes on with its clients until it is
/// handed over. wanted(), take_inputs(), the columns and hand_over() may be used by another thread than that
/// which polls, but only by one. Columns are written between wanted() and hand_over(), all of them.
class __attribute__((visibility("default"))) HandedColumns final : public engine::Simulation {
 public:
  explicit HandedColumns(HandedColumnsOptions options);
  ~HandedColumns() override;
  HandedColumns(const HandedColumns&) = delete;
  HandedColumns& operator=(const HandedColumns&) = delete;

  [[nodiscard]] std::span<float> position(std::size_t axis);
  [[nodiscard]] std::span<float> velocity(std::size_t axis);
  [[nodiscard]] std::span<float> orientation(std::size_t axis);  ///< x, y, z, w; empty unless bodies turn
  [[nodiscard]] std::span<float> angular_velocity(std::size_t axis);  ///< rad / s; empty unless bodies turn
  /// 0: dead, as all are at first. A change from one other value to another: another body is in the slot.
  [[nodiscard]] std::span<std::uint8_t> alive();
  [[nodiscard]] std::span<std::uint16_t> type();
  /// The bodies' own data: HandedColumnsOptions::data_bytes for each slot; see engine::Bodies::data.
  [[nodiscard]] std::span<std::byte> data();

  /// A frame is due.
  [[nodiscard]] bool wanted();
  /// What acts in the frame that is due, in its order.
  [[nodiscard]] std::vector<engine::Input> take_inputs();
  /// The columns hold the frame that was wanted; if none was, nothing happens.
  void hand_over();

  // engine::Simulation, for the server.
  [[nodiscard]] std::uint32_t capacity() const override;
  [[nodiscard]] double dt_s() const override;
  [[nodiscard]] engine::Vec3 gravity() const override;
  [[nodiscard]] double damping_per_s() const override;
  [[nodiscard]] engine::Classification classify(const engine::Input& input) const override;
  void apply(const engine::Input& input) override;
  void step() override;
  void begin_step() override;
  [[nodiscard]] bool step_ready() override;
  [[nodiscard]] int step_descriptor() const override;
  [[nodiscard]] engine::Bodies bodies() const override;
  [[nodiscard]] std::span<const engine::Event> events() const override;
  void save(std::vector<std::byte>& out) const override;
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem
