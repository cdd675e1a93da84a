#pragma once
// tandem::Client: the functions of tandem/tandem.h for C++20. That header describes what each of them does.
// This one is header-only; an application links the C library.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "tandem/body_shape.hpp"
#include "tandem/client_types.hpp"
#include "tandem/result.hpp"
#include "tandem/tandem.h"

namespace tandem {

/// Options of Client::connect().
struct ClientOptions {
  std::string session = {};  ///< 1..64 characters of [A-Za-z0-9._-]; empty: "default", and any of a `url`
  std::uint32_t domain = 0;  ///< DDS domain, 0..230
  ClientRole role = ClientRole::kParticipant;
  std::uint32_t lead = 1;  ///< frames to simulate beyond the last delta; clamped to what the session allows
  /// True: the client has a thread that does its work. False: the application calls update() at least once a
  /// frame, and all work is done in that call.
  bool background = true;
  /// EXPERIMENTAL. sample() shows the gravity that this application sent at once, before the server has said
  /// on which frame it acts.
  bool echo = false;
  /// Which of the session's streams to play: "auto", "bandwidth", "computing", "error" or a name; see
  /// tandem_options::prefer.
  std::string prefer = "auto";
  /// The kind of network, "NAME" or "NAME:key=value,..."; see tandem_options::profile. Empty: CYCLONEDDS_URI
  /// decides.
  std::string profile = {};
  /// Folder of this program's identity for DDS Security; see tandem_options::secure. Empty: none.
  std::string secure = {};
  /// Join over a gateway instead of DDS; see tandem_options::url, `token` and `tls_ca`. Empty: DDS.
  std::string url = {}, token = {}, tls_ca = {};
  std::uint32_t threads = 1;  ///< that share the work on many bodies; see tandem_options::threads
  /// For which frames may be collected, as tandem_options::max_delay_s; 0: none. Empty: 0.2 for an observer,
  /// 0 for a participant.
  std::optional<double> max_delay_s = {};
  std::uint32_t max_kbit_s = 0;  ///< on the network, 0: no cap; see tandem_options::max_kbit_s
  /// Receives one line for a human. It is called by the thread that does the client's work. It must return
  /// soon and must not call the client. Exceptions that it throws are dropped.
  std::function<void(LogLevel, std::string_view)> log = {};
};

/// The appearance of the bodies of a type.
struct BodyTypeInfo {
  std::string name;
  float radius = 0;               ///< radius of the sphere around the body; scene units
  std::uint32_t colour_rgba = 0;  ///< 0xRRGGBBAA
  BodyShape shape = BodyShape::kSphere;
  std::vector<float> shape_values = {};  ///< see BodyShape
};

/// One part of the scene that does not move; see tandem_solid.
struct Solid {
  enum class Shape : std::int32_t {
    kPlane = TANDEM_SHAPE_PLANE,
    kBox = TANDEM_SHAPE_BOX,
    kSphere = TANDEM_SHAPE_SPHERE
  };
  Shape shape = Shape::kPlane;
  std::array<float, 3> centre{};                 ///< centre; for a plane: any point on it
  std::array<float, 4> orientation{0, 0, 0, 1};  ///< box: x, y, z, w
  std::array<float, 3> half_size{};              ///< box: half sizes x, y, z
  std::array<float, 3> normal{};                 ///< plane: norm 1; points to the side where the bodies are
  float radius = 0;                              ///< sphere only
};

/// The scene of a session; see tandem_scene.
struct Scene {
  std::string name;
  std::uint32_t capacity = 0;  ///< slots
  double frame_rate_hz = 0;
  std::array<double, 3> gravity{};       ///< gravity at the epoch's first frame; scene units / s^2
  double max_gravity = 0, max_push = 0;  ///< the server refuses more; 0: unknown
  std::array<float, 3> low{}, high{};    ///< bounds; all 0: unknown
  std::vector<Solid> solids;
  double dt_s = 0;                                         ///< seconds that one frame simulates
  std::uint32_t up_axis = 1;                               ///< the axis that points up: 0 x, 1 y, 2 z
  std::uint64_t continues_epoch = 0, continues_frame = 0;  ///< see tandem_scene; 0: none
};

/// A session on a domain; see tandem_session_info.
struct SessionInfo {
  std::string name, scene, codec, predictor;
  bool playable = false;  ///< this build can play it
  std::uint64_t epoch = 0;
  std::uint32_t capacity = 0, bodies = 0, participants = 0, observers = 0;
  double frame_rate_hz = 0;
  double client_ms = 0;   ///< computing time of a client for one frame, measured on the server's processor
  double mbit_per_s = 0;  ///< current payload rate
  double dt_s = 0;        ///< seconds that one frame simulates
  std::array<double, 3> gravity{};                         ///< at the epoch's first frame; scene units / s^2
  std::uint32_t up_axis = 1;                               ///< the axis that points up: 0 x, 1 y, 2 z
  std::uint64_t continues_epoch = 0, continues_frame = 0;  ///< see tandem_session_info; 0: none
};

/// Where Client::sample() writes one kind of value of each body: a plain array, or a member of an array of
/// structs. An empty column is not written.
template <class T>
class Column {
 public:
  Column() = default;
  /// `first`: where the first body's value goes. `stride_bytes`: distance to the next body's; 0: the values
  /// are side by side.
  Column(T* first, std::size_t stride_bytes = 0) : first_(first), stride_(stride_bytes) {}
  /// A member of each struct. The member is a T, or a struct or array that begins with as many T as a body
  /// has of them.
  template <class Struct, class Member>
  Column(std::span<Struct> bodies, Member Struct::*member)
      : first_(bodies.empty() ? nullptr : reinterpret_cast<T*>(&(bodies.front().*member))),
        stride_(sizeof(Struct)) {}

  [[nodiscard]] T* first() const { return first_; }
  [[nodiscard]] std::size_t stride_bytes() const { return stride_; }

 private:
  T* first_ = nullptr;
  std::size_t stride_ = 0;
};

/// See tandem_columns.
struct Columns {
  std::size_t capacity = 0;  ///< number of bodies that every column has room for
  Column<float> positions = {}, velocities = {}, orientations = {}, angular_velocities = {};
  Column<std::uint16_t> types = {};
  Column<std::uint8_t> alive = {}, reuse = {}, changes = {};
};

/// See tandem_sample_options.
struct SampleOptions {
  SampleMode mode = SampleMode::kExtrapolate;
  std::int64_t at_ns = 0;   ///< by tandem_clock_ns(); 0: now
  double smoothing_s = -1;  ///< below 0: the default; 0: corrections show as jumps
};

/// One client of one session. Movable; a moved-from client answers kInvalidHandle. All members may be called
/// from any thread. All but sample() may wait until the current frame is applied.
class Client {
 public:
  /// Starts looking for the session. Returns at once, even if there is no server. Errors: kInvalidArgument
  /// (session name, domain, lead, URL), kTransport (DDS could not start), kIo (`tls_ca`), kUnsupported (see
  /// tandem_join()).
  [[nodiscard]] static Result<Client> connect(const ClientOptions& options) {
    Client client;
    tandem_options c = TANDEM_OPTIONS_INIT;
    if (!options.session.empty()) c.session = options.session.c_str();
    if (!options.url.empty()) c.url = options.url.c_str();
    c.token = options.token.c_str();
    c.tls_ca = options.tls_ca.c_str();
    c.domain = options.domain;
    c.secure = options.secure.c_str();
    c.role = static_cast<tandem_role>(options.role);
    c.lead = options.lead;
    c.background = options.background ? 1 : 0;
    c.echo = options.echo ? 1 : 0;
    c.prefer = options.prefer.c_str();
    c.profile = options.profile.c_str();
    c.threads = options.threads;
    // In C, 0 stands for the default; so little is none.
    c.max_delay_s = options.max_delay_s ? (*options.max_delay_s == 0 ? 1e-4 : *options.max_delay_s) : 0;
    c.max_kbit_s = options.max_kbit_s;
    if (options.log) {
      client.log_ = std::make_unique<Log>(options.log);
      c.log = &call_log;
      c.user = client.log_.get();
    }
    if (auto joined = checked(tandem_join(&c, &client.handle_)); !joined) return unexpected(joined);
    client.background_ = options.background;
    return client;
  }
  Client(Client&& other) noexcept
      : log_(std::move(other.log_)),
        handle_(std::exchange(other.handle_, 0)),
        background_(other.background_) {}
  Client& operator=(Client&& other) noexcept {
    std::swap(log_, other.log_);
    std::swap(handle_, other.handle_);
    std::swap(background_, other.background_);
    return *this;
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  /// Leaves the session. Waits for calls of other threads.
  ~Client() {
    if (handle_ == 0 || tandem_leave(handle_) != TANDEM_IN_CALLBACK) return;
    // This destructor runs in the log function of another client. This client's own log function must outlive
    // it.
    std::thread([handle = handle_, log = std::move(log_)] { tandem_leave(handle); }).detach();
  }

  /// The handle for the functions of tandem/tandem.h; 0 if this client was moved from.
  [[nodiscard]] tandem_client handle() const { return handle_; }

  /// Updates a client that has no thread: takes what arrived, follows the session, and waits at most `wait_s`
  /// seconds for something to do. Errors: kWrongThread.
  Result<void> update(double wait_s = 0) { return checked(tandem_update(handle_, wait_s)); }
  /// Lets the session go on for `seconds`: updates the client, or sleeps if a thread does its work.
  void run_for(double seconds);
  /// Blocks until the client plays or `timeout_s` seconds have passed. Updates the client if it has no
  /// thread. Errors: kTimeout.
  Result<void> wait_until_playing(double timeout_s) {
    return checked(tandem_wait_until_playing(handle_, timeout_s));
  }
  /// Changes ClientOptions::prefer.
  [[nodiscard]] Result<void> prefer(const std::string& preference) {
    return checked(tandem_prefer(handle_, preference.c_str()));
  }
  [[nodiscard]] Result<ClientStatus> status() const;
  /// Takes the oldest event; empty if there is none.
  [[nodiscard]] std::optional<tandem_event> next_event() {
    tandem_event event = TANDEM_EVENT_INIT;
    if (tandem_next_event(handle_, &event) != TANDEM_OK) return std::nullopt;
    return event;
  }

  /// Takes the oldest news of the session's keys and events; empty if there are none.
  [[nodiscard]] std::optional<tandem_news> next_news() {
    tandem_news news = TANDEM_NEWS_INIT;
    if (tandem_next_news(handle_, &news) != TANDEM_OK) return std::nullopt;
    return news;
  }
  /// The value that a key of the session has at the last frame applied; empty if there is no such key.
  [[nodiscard]] std::optional<std::vector<std::byte>> key(const std::string& name) const {
    std::vector<std::byte> value(256);
    for (std::size_t count = 0;; value.resize(count)) {
      const tandem_result got = tandem_get_key(handle_, name.c_str(), value.data(), value.size(), &count);
      if (got == TANDEM_CAPACITY) continue;
      if (got != TANDEM_OK) return std::nullopt;
      value.resize(count);
      return value;
    }
  }
  /// The keys that the session has, ascending.
  [[nodiscard]] std::vector<std::string> keys() const {
    std::vector<std::string> keys;
    std::array<char, TANDEM_KEY_SIZE> name{};
    while (tandem_get_key_name(handle_, static_cast<std::uint32_t>(keys.size()), name.data(), name.size()) ==
           TANDEM_OK)
      keys.emplace_back(name.data());
    return keys;
  }

  /// The fields of the data that each body has, in the order of a record; empty if there are none.
  [[nodiscard]] std::vector<tandem_data_field> data_fields() const {
    std::vector<tandem_data_field> fields;
    tandem_data_field field = TANDEM_DATA_FIELD_INIT;
    while (tandem_get_data_field(handle_, static_cast<std::uint32_t>(fields.size()), &field) == TANDEM_OK)
      fields.push_back(field);
    return fields;
  }
  /// The values of a field at the last frame applied, by slot; zeros for slots without a body. `T` has the
  /// size of the field's values. Empty if there is no such field, or the client does not play a stream with
  /// data.
  template <class T>
  [[nodiscard]] std::vector<T> data(const std::string& field) const {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::vector<tandem_data_field> fields = data_fields();
    const bool fits = std::any_of(fields.begin(), fields.end(), [&](const tandem_data_field& each) {
      return each.name == field && each.value_size == sizeof(T);
    });
    std::size_t bytes = 0;
    if (!fits || tandem_get_data(handle_, field.c_str(), nullptr, 0, &bytes, nullptr) != TANDEM_OK) return {};
    std::vector<T> values(bytes / sizeof(T));
    if (tandem_get_data(handle_, field.c_str(), values.data(), bytes, nullptr, nullptr) != TANDEM_OK)
      return {};
    return values;
  }

  /// Sends an input and returns its number. The input acts on the same frame everywhere; an event tells
  /// which. Errors: kNotReady (not playing), kOutOfOrder (joined as an observer), kInvalidArgument (not
  /// finite, more than 1,024 bytes), kTransport.
  [[nodiscard]] Result<std::uint64_t> send_gravity(std::array<double, 3> metres_per_s2) {
    std::uint64_t number = 0;
    return numbered(tandem_send_gravity(handle_, metres_per_s2.data(), &number), number);
  }
  /// Adds `velocity` to the bodies within `radius` of `centre`; scene units.
  [[nodiscard]] Result<std::uint64_t> send_push(std::array<double, 3> centre, double radius,
                                                std::array<double, 3> velocity) {
    std::uint64_t number = 0;
    return numbered(tandem_send_push(handle_, centre.data(), radius, velocity.data(), &number), number);
  }
  /// Sends bytes whose meaning only the server's simulation knows.
  [[nodiscard]] Result<std::uint64_t> send_bytes(std::span<const std::byte> bytes) {
    std::uint64_t number = 0;
    return numbered(tandem_send_bytes(handle_, bytes.data(), bytes.size(), &number), number);
  }

  /// EXPERIMENTAL. Moves the replay of a recording to `seconds` after its first message, for all clients and
  /// under a new epoch; TANDEM_EVENT_NEW_EPOCH tells that it has moved. The server refuses it if the time is
  /// beyond the recording, if the session is not a replay, and less than a second after another seek.
  [[nodiscard]] Result<std::uint64_t> send_seek(double seconds) {
    std::uint64_t number = 0;
    return numbered(tandem_send_seek(handle_, seconds, &number), number);
  }

  /// Writes the bodies as they should be drawn straight into the application's memory. Errors: kNotReady
  /// (nothing to draw yet), kCapacity (the session has more slots), kInvalidArgument.
  Result<tandem_frame> sample(const Columns& columns, const SampleOptions& options = {}) {
    tandem_frame frame = TANDEM_FRAME_INIT;
    if (const auto sampled = checked(sample_into(columns, options, frame)); !sampled)
      return unexpected(sampled);
    return frame;
  }
  /// Returns the moment that would be drawn and the number of bodies, without writing columns.
  Result<tandem_frame> sample_frame(const SampleOptions& options = {}) {
    tandem_frame frame = TANDEM_FRAME_INIT;
    const tandem_sample_options how = to_c(options);
    if (const auto sampled = checked(tandem_sample(handle_, &how, nullptr, &frame)); !sampled) {
      return unexpected(sampled);
    }
    return frame;
  }
  /// Does the same with arrays that grow with the session. Returns false and leaves `out` as it is if there
  /// is nothing to draw. Allocates only when the capacity changed.
  bool sample(Sample& out, SampleMode mode = SampleMode::kExtrapolate);

  /// The body types of the session; empty before one is joined.
  [[nodiscard]] std::vector<BodyTypeInfo> types() const;
  /// Geometry, gravity and bounds. Errors: kNotReady (no session is known yet), kMalformed.
  [[nodiscard]] Result<Scene> scene() const;
  /// The name of the body that is in a slot now; empty if it has none. Errors: kNotReady (not playing),
  /// kInvalidArgument (the session has fewer slots).
  [[nodiscard]] Result<std::string> body_name(std::uint32_t slot) const {
    std::array<char, TANDEM_BODY_NAME_SIZE> name{};
    if (const auto got = checked(tandem_get_body_name(handle_, slot, name.data(), name.size())); !got)
      return unexpected(got);
    return std::string(name.data());
  }

 private:
  friend class Browser;
  using Log = std::function<void(LogLevel, std::string_view)>;
  Client() = default;

  static void call_log(void* user, tandem_log_level level, const char* line) {
    try {
      (*static_cast<Log*>(user))(static_cast<LogLevel>(level), line);
    } catch (...) {  // an exception must not cross the C functions
    }
  }
  [[nodiscard]] static Result<void> checked(tandem_result result) {
    if (result == TANDEM_OK) return {};
    return fail(static_cast<ErrorCode>(result), tandem_error_text());
  }
  [[nodiscard]] static tl::unexpected<Error> unexpected(const Result<void>& failed) {
    return tl::unexpected<Error>(failed.error());
  }
  [[nodiscard]] static Result<std::uint64_t> numbered(tandem_result result, const std::uint64_t& number) {
    if (const auto sent = checked(result); !sent) return unexpected(sent);
    return number;
  }
  [[nodiscard]] static tandem_sample_options to_c(const SampleOptions& options) {
    tandem_sample_options c = TANDEM_SAMPLE_OPTIONS_INIT;
    c.mode = static_cast<tandem_sample_mode>(options.mode);
    c.at_ns = options.at_ns;
    c.smoothing_s = options.smoothing_s;
    return c;
  }
  tandem_result sample_into(const Columns& columns, const SampleOptions& options, tandem_frame& frame);

  std::unique_ptr<Log> log_;
  tandem_client handle_ = 0;
  bool background_ = true;
};

/// Watches the sessions of a domain without joining any. Movable. All members may be called from any thread.
class Browser {
 public:
  /// `profile`, `secure`: see ClientOptions. Errors: kInvalidArgument (domain, profile, identity), kIo
  /// (identity), kTransport (DDS could not start).
  [[nodiscard]] static Result<Browser> open(std::uint32_t domain = 0, const std::string& profile = {},
                                            const std::string& secure = {}) {
    Browser browser;
    tandem_options c = TANDEM_OPTIONS_INIT;
    c.domain = domain;
    c.profile = profile.c_str();
    c.secure = secure.c_str();
    if (const auto opened = Client::checked(tandem_browser_open_with(&c, &browser.handle_)); !opened)
      return Client::unexpected(opened);
    return browser;
  }
  Browser(Browser&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Browser& operator=(Browser&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;
  ~Browser() {
    if (handle_ == 0 || tandem_browser_close(handle_) != TANDEM_IN_CALLBACK) return;
    std::thread([handle = handle_] { tandem_browser_close(handle); }).detach();
  }

  /// The sessions that are on the domain now, sorted by name. Does not wait: a session is found within one or
  /// two seconds after open().
  [[nodiscard]] Result<std::vector<SessionInfo>> sessions() const;

 private:
  Browser() = default;
  tandem_browser handle_ = 0;
};

/// The sessions of a domain, after watching it for `watch_s`.
[[nodiscard]] inline Result<std::vector<SessionInfo>> sessions(std::uint32_t domain = 0, double watch_s = 2,
                                                               const std::string& profile = {},
                                                               const std::string& secure = {}) {
  const auto browser = Browser::open(domain, profile, secure);
  if (!browser) return tl::unexpected<Error>(browser.error());
  std::this_thread::sleep_for(std::chrono::duration<double>(watch_s));
  return browser->sessions();
}

inline Result<std::vector<SessionInfo>> Browser::sessions() const {
  std::vector<tandem_session_info> found;
  std::size_t count = 0;
  do {  // more may come in between
    found.assign(count, TANDEM_SESSION_INFO_INIT);
    const tandem_result result = tandem_browser_list(handle_, found.data(), found.size(), &count);
    if (result != TANDEM_CAPACITY) {
      if (const auto listed = Client::checked(result); !listed) return Client::unexpected(listed);
    }
  } while (count > found.size());
  std::vector<SessionInfo> out;
  for (std::size_t i = 0; i < count; ++i) {
    const tandem_session_info& c = found[i];
    out.push_back({c.name, c.scene, c.codec, c.predictor, c.playable != 0, c.epoch, c.capacity, c.bodies,
                   c.participants, c.observers, c.frame_rate_hz, c.client_ms, c.mbit_per_s, c.dt_s,
                   std::to_array(c.gravity), c.up_axis, c.continues_epoch, c.continues_frame});
  }
  return out;
}

inline Result<Scene> Client::scene() const {
  tandem_scene c = TANDEM_SCENE_INIT;
  if (const auto got = checked(tandem_get_scene(handle_, &c)); !got) return unexpected(got);
  Scene scene;
  scene.name = c.name;
  scene.capacity = c.capacity;
  scene.frame_rate_hz = c.frame_rate_hz;
  scene.max_gravity = c.max_gravity;
  scene.max_push = c.max_push;
  scene.gravity = std::to_array(c.gravity);
  scene.low = std::to_array(c.low);
  scene.high = std::to_array(c.high);
  scene.dt_s = c.dt_s;
  scene.up_axis = c.up_axis;
  scene.continues_epoch = c.continues_epoch;
  scene.continues_frame = c.continues_frame;
  std::vector<tandem_solid> solids(c.solid_count, TANDEM_SOLID_INIT);
  std::size_t count = 0;
  const tandem_result result = tandem_get_geometry(handle_, solids.data(), solids.size(), &count);
  if (result != TANDEM_OK && result != TANDEM_CAPACITY) return unexpected(checked(result));
  for (std::size_t i = 0; i < count && i < solids.size(); ++i) {
    const tandem_solid& s = solids[i];
    scene.solids.push_back({static_cast<Solid::Shape>(s.shape), std::to_array(s.centre),
                            std::to_array(s.orientation), std::to_array(s.half_size), std::to_array(s.normal),
                            s.radius});
  }
  return scene;
}

inline void Client::run_for(double seconds) {
  const auto left_s = [end_ns = static_cast<double>(tandem_clock_ns()) + seconds * 1e9] {
    return (end_ns - static_cast<double>(tandem_clock_ns())) / 1e9;
  };
  for (double wait_s = left_s(); wait_s > 0; wait_s = left_s()) {
    if (background_) return std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
    if (!update(wait_s)) return;
  }
}

inline Result<ClientStatus> Client::status() const {
  tandem_status c = TANDEM_STATUS_INIT;
  if (const auto got = checked(tandem_get_status(handle_, &c)); !got) return unexpected(got);
  ClientStatus s;
  each_client_figure([](const char*, auto& to, const auto& from) { to = from; }, s, c);
  each_client_state([](const char*, auto& to,
                       const auto& from) { to = static_cast<std::remove_reference_t<decltype(to)>>(from); },
                    s, c);
  return s;
}

inline std::vector<BodyTypeInfo> Client::types() const {
  std::vector<BodyTypeInfo> types;
  tandem_body_type c = TANDEM_BODY_TYPE_INIT;
  while (tandem_get_type(handle_, static_cast<std::uint32_t>(types.size()), &c) == TANDEM_OK) {
    BodyTypeInfo& type = types.emplace_back();
    type.name = c.name;
    type.radius = c.radius;
    type.colour_rgba = c.colour_rgba;
    type.shape = static_cast<BodyShape>(c.shape);
    type.shape_values.resize(c.value_count);
    static_cast<void>(tandem_get_type_values(handle_, static_cast<std::uint32_t>(types.size() - 1),
                                             type.shape_values.data(), type.shape_values.size(), nullptr));
  }
  return types;
}

inline tandem_result Client::sample_into(const Columns& columns, const SampleOptions& options,
                                         tandem_frame& frame) {
  const tandem_sample_options how = to_c(options);
  tandem_columns c = TANDEM_COLUMNS_INIT;
  const auto count = [](std::size_t n) {  // larger values mean the same as the maximum
    constexpr std::size_t kMax = std::numeric_limits<std::uint32_t>::max();
    return static_cast<std::uint32_t>(n < kMax ? n : kMax);
  };
  const auto put = [&](const auto& column, auto*& first, std::uint32_t& stride) {
    first = column.first();
    stride = count(column.stride_bytes());
  };
  c.capacity = count(columns.capacity);
  put(columns.positions, c.positions, c.position_stride);
  put(columns.velocities, c.velocities, c.velocity_stride);
  put(columns.orientations, c.orientations, c.orientation_stride);
  put(columns.angular_velocities, c.angular_velocities, c.angular_velocity_stride);
  put(columns.types, c.types, c.type_stride);
  put(columns.alive, c.alive, c.alive_stride);
  put(columns.reuse, c.reuse, c.reuse_stride);
  put(columns.changes, c.changes, c.change_stride);
  return tandem_sample(handle_, &how, &c, &frame);
}

inline bool Client::sample(Sample& out, SampleMode mode) {
  tandem_frame frame = TANDEM_FRAME_INIT;
  const auto resize = [&](std::size_t capacity) {
    out.positions.resize(3 * capacity);
    out.alive.resize(capacity);
    out.generation.resize(capacity);
    out.types.resize(capacity);
    out.changes.resize(capacity);
  };
  for (bool told = false;;) {
    Columns columns;
    columns.capacity = out.alive.size();
    columns.positions = out.positions.data();
    columns.orientations = out.orientations.data();
    columns.types = out.types.data();
    columns.alive = out.alive.data();
    columns.reuse = out.generation.data();
    if (!told) columns.changes = reinterpret_cast<std::uint8_t*>(out.changes.data());
    const std::size_t turning = out.orientations.size() / 4;
    if (turning != 0 && turning < columns.capacity) columns.capacity = turning;
    const tandem_result result = sample_into(columns, {.mode = mode}, frame);
    if (result != TANDEM_OK && result != TANDEM_CAPACITY) return false;
    resize(frame.capacity);
    const std::size_t quaternions = frame.has_orientations != 0 ? frame.capacity : 0;
    const bool missed = turning < quaternions;
    out.orientations.resize(4 * quaternions);
    if (result == TANDEM_OK && !missed) break;
    told = told || result == TANDEM_OK;  // changes are reported only once
  }
  out.epoch = frame.epoch;
  out.frame = frame.frame;
  out.capacity = frame.capacity;
  return true;
}

}  // namespace tandem
