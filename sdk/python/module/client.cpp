// tandem._client: the functions of tandem.h for the Python classes in tandem/, which have the names, the
// types and the manual.

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/python/module/columns.hpp"
#include "tandem/client_types.hpp"
#include "tandem/tandem.h"

namespace tandem::python {
namespace {

using namespace pybind11::literals;
using Vector = std::array<double, 3>;

void check(tandem_result result) {
  if (result != TANDEM_OK) raise_error(result, tandem_error_text());
}

// Calls without the interpreter's lock: whatever may wait for a client may wait for its log callback, which
// takes the lock.
template <class Call>
tandem_result unlocked(const Call& call) {
  const py::gil_scoped_release release;
  return call();
}

// The callback of tandem_options. An exception has nowhere to go: Python reports it.
void log_line(void* user, tandem_log_level level, const char* line) {
  TANDEM_ASSERT(user != nullptr && line != nullptr);
  const py::gil_scoped_acquire acquire;
  try {
    const py::str text = py::reinterpret_steal<py::str>(PyUnicode_DecodeUTF8(
        line, static_cast<py::ssize_t>(std::char_traits<char>::length(line)), "replace"));
    static_cast<py::function*>(user)->operator()(level, text);
  } catch (py::error_already_set& failure) {
    failure.discard_as_unraisable("the log function of a tandem.Client");
  }
}

/// A client and its log function.
class Connection {
 public:
  Connection(std::uint32_t domain, const py::object& session, tandem_role role, std::uint32_t lead,
             bool background, bool echo, const std::string& prefer, const std::string& profile,
             const std::string& secure, const std::string& url, const std::string& token,
             const std::string& tls_ca, std::uint32_t threads, std::optional<double> max_delay_s,
             std::uint32_t max_kbit_s, const py::object& log) {
    tandem_options options = TANDEM_OPTIONS_INIT;
    options.domain = domain;
    std::string name;
    if (!session.is_none()) {
      name = session.cast<std::string>();
      options.session = name.c_str();
    }
    if (!url.empty()) options.url = url.c_str();
    options.token = token.c_str();
    options.tls_ca = tls_ca.c_str();
    options.threads = threads;
    options.max_delay_s = max_delay_s ? (*max_delay_s == 0 ? 1e-4 : *max_delay_s) : 0;  // 0: the default
    options.max_kbit_s = max_kbit_s;
    options.role = role;
    options.lead = lead;
    options.background = background ? 1 : 0;
    options.echo = echo ? 1 : 0;
    options.prefer = prefer.c_str();
    options.secure = secure.c_str();
    options.profile = profile.c_str();
    if (!log.is_none()) {
      log_ = std::make_unique<py::function>(log);
      options.log = &log_line;
      options.user = log_.get();
    }
    check(unlocked([&] { return tandem_join(&options, &client_); }));
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() {
    if (unlocked([this] { return tandem_leave(client_); }) != TANDEM_IN_CALLBACK) return;
    // The interpreter collects what nobody holds at any moment, within a log function too.
    std::thread([client = client_, log = log_.release()] {
      tandem_leave(client);
      const py::gil_scoped_acquire acquire;
      delete log;
    }).detach();
  }

  void leave() {
    check(unlocked([this] { return tandem_leave(client_); }));
  }
  void update(double wait_s) {
    check(unlocked([&] { return tandem_update(client_, wait_s); }));
  }
  void prefer(const std::string& preference) {
    check(unlocked([&] { return tandem_prefer(client_, preference.c_str()); }));
  }
  // Waits in slices, so that Ctrl-C ends the wait.
  void wait_until_playing(double timeout_s) {
    constexpr double kSliceS = 0.1;
    using Seconds = std::chrono::duration<double>;
    const auto start = std::chrono::steady_clock::now();
    for (;;) {
      const double left_s = timeout_s - Seconds(std::chrono::steady_clock::now() - start).count();
      const auto result =
          unlocked([&] { return tandem_wait_until_playing(client_, std::clamp(left_s, 0.0, kSliceS)); });
      if (result != TANDEM_TIMEOUT || left_s <= kSliceS) return check(result);
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
  }

  [[nodiscard]] py::dict status() const {
    tandem_status s = TANDEM_STATUS_INIT;
    check(unlocked([&] { return tandem_get_status(client_, &s); }));
    py::dict out;
    const auto add = [&out](const char* name, const auto& value) { out[name] = value; };
    each_client_state(add, s);
    out["server_alive"] = s.server_alive != 0;
    each_client_figure(add, s);
    out["events_dropped"] = s.events_dropped;
    return out;
  }

  /// `arrays`: the eight columns in the order of tandem_columns, None for what is not wanted. Returns the
  /// result, TANDEM_OK or TANDEM_CAPACITY, and what was sampled.
  [[nodiscard]] py::tuple sample(tandem_sample_mode mode, std::int64_t at_ns, double smoothing_s,
                                 const py::tuple& arrays) const {
    tandem_sample_options options = TANDEM_SAMPLE_OPTIONS_INIT;
    options.mode = mode;
    options.at_ns = at_ns;
    options.smoothing_s = smoothing_s;
    tandem_columns columns = TANDEM_COLUMNS_INIT;
    bool wanted = false;
    const auto place = [&](auto& first, std::uint32_t& stride, std::size_t which, const char* name,
                           py::ssize_t components) {
      const auto column = column_of<std::remove_pointer_t<std::remove_reference_t<decltype(first)>>>(
          arrays[which], name, components);
      if (column.first == nullptr) return;
      first = column.first;
      stride = column.stride;
      columns.capacity = wanted ? std::min(columns.capacity, column.bodies) : column.bodies;
      wanted = true;
    };
    place(columns.positions, columns.position_stride, 0, "positions", 3);
    place(columns.velocities, columns.velocity_stride, 1, "velocities", 3);
    place(columns.orientations, columns.orientation_stride, 2, "orientations", 4);
    place(columns.angular_velocities, columns.angular_velocity_stride, 3, "angular_velocities", 3);
    place(columns.types, columns.type_stride, 4, "types", 1);
    place(columns.alive, columns.alive_stride, 5, "alive", 1);
    place(columns.reuse, columns.reuse_stride, 6, "reuse", 1);
    place(columns.changes, columns.change_stride, 7, "changes", 1);
    tandem_frame frame = TANDEM_FRAME_INIT;
    const auto result =
        unlocked([&] { return tandem_sample(client_, &options, wanted ? &columns : nullptr, &frame); });
    if (result != TANDEM_CAPACITY) check(result);
    return py::make_tuple(result, frame.capacity, frame.epoch, frame.frame, frame.seconds_since_delta,
                          frame.alive, frame.has_orientations != 0, frame.mode, frame.phase);
  }

  [[nodiscard]] py::object next_event() const {
    tandem_event e = TANDEM_EVENT_INIT;
    const auto result = unlocked([&] { return tandem_next_event(client_, &e); });
    if (result == TANDEM_NOT_READY) return py::none();
    check(result);
    return py::dict("kind"_a = e.kind, "number"_a = e.number, "frame"_a = e.frame, "epoch"_a = e.epoch,
                    "at_ns"_a = e.at_ns, "reason"_a = e.reason, "dropped"_a = e.dropped, "text"_a = e.text);
  }

  [[nodiscard]] py::object next_news() const {
    tandem_news n = TANDEM_NEWS_INIT;
    const auto result = unlocked([&] { return tandem_next_news(client_, &n); });
    if (result == TANDEM_NOT_READY) return py::none();
    check(result);
    const py::object body = n.has_body != 0 ? py::object(py::make_tuple(n.slot, n.reuse)) : py::none();
    const bool is_event = n.what == TANDEM_NEWS_EVENT;
    return py::dict(
        "what"_a = n.what, "epoch"_a = n.epoch, "frame"_a = n.frame, "number"_a = n.number,
        "event"_a = n.kind, "body"_a = body, "key"_a = n.key, "gone"_a = n.gone != 0,
        "data"_a = py::bytes(reinterpret_cast<const char*>(n.bytes), is_event ? n.byte_count : 0));
  }
  [[nodiscard]] py::object key(const std::string& name) const {
    std::string value(256, '\0');
    std::size_t count = 0;
    tandem_result result = TANDEM_CAPACITY;
    for (; result == TANDEM_CAPACITY; value.resize(count)) {
      result =
          unlocked([&] { return tandem_get_key(client_, name.c_str(), value.data(), value.size(), &count); });
      if (result == TANDEM_NOT_READY) return py::none();
    }
    check(result);
    return py::bytes(value);
  }
  [[nodiscard]] py::list keys() const {
    py::list list;
    std::array<char, TANDEM_KEY_SIZE> name{};
    for (std::uint32_t index = 0;; ++index) {
      const auto result =
          unlocked([&] { return tandem_get_key_name(client_, index, name.data(), name.size()); });
      if (result == TANDEM_NOT_READY) return list;
      check(result);
      list.append(py::str(name.data()));
    }
  }

  [[nodiscard]] py::list data_fields() const {
    py::list list;
    for (std::uint32_t index = 0;; ++index) {
      tandem_data_field field = TANDEM_DATA_FIELD_INIT;
      const auto result = unlocked([&] { return tandem_get_data_field(client_, index, &field); });
      if (result == TANDEM_NOT_READY) return list;
      check(result);
      list.append(py::make_tuple(field.name, field.kind));
    }
  }
  [[nodiscard]] py::object data() const {
    std::string records;
    std::size_t count = 0;
    const auto read = [&] {
      return unlocked(
          [&] { return tandem_get_data(client_, nullptr, records.data(), records.size(), &count, nullptr); });
    };
    for (tandem_result result = read();; result = read()) {
      if (result == TANDEM_NOT_READY) return py::none();
      if (result != TANDEM_CAPACITY) check(result);
      if (result == TANDEM_OK && count == records.size()) return py::bytes(records);
      records.resize(count);
    }
  }

  [[nodiscard]] std::uint64_t send_gravity(const Vector& gravity) const {
    std::uint64_t number = 0;
    check(unlocked([&] { return tandem_send_gravity(client_, gravity.data(), &number); }));
    return number;
  }
  [[nodiscard]] std::uint64_t send_push(const Vector& centre, double radius, const Vector& velocity) const {
    std::uint64_t number = 0;
    check(
        unlocked([&] { return tandem_send_push(client_, centre.data(), radius, velocity.data(), &number); }));
    return number;
  }
  [[nodiscard]] std::uint64_t send_seek(double seconds) const {
    std::uint64_t number = 0;
    check(unlocked([&] { return tandem_send_seek(client_, seconds, &number); }));
    return number;
  }
  [[nodiscard]] std::uint64_t send_bytes(const py::bytes& bytes) const {
    const auto view = static_cast<std::string_view>(bytes);
    std::uint64_t number = 0;
    check(unlocked([&] { return tandem_send_bytes(client_, view.data(), view.size(), &number); }));
    return number;
  }

  [[nodiscard]] py::dict scene() const {
    tandem_scene s = TANDEM_SCENE_INIT;
    check(unlocked([&] { return tandem_get_scene(client_, &s); }));
    const auto triple = [](const auto* from) { return py::make_tuple(from[0], from[1], from[2]); };
    const bool told = std::ranges::any_of(s.low, [](float x) { return x != 0; }) ||
                      std::ranges::any_of(s.high, [](float x) { return x != 0; });
    return py::dict(
        "name"_a = s.name, "capacity"_a = s.capacity, "frame_rate_hz"_a = s.frame_rate_hz,
        "gravity"_a = triple(s.gravity), "max_gravity"_a = s.max_gravity, "max_push"_a = s.max_push,
        "bounds"_a = told ? py::object(py::make_tuple(triple(s.low), triple(s.high))) : py::none(),
        "dt_s"_a = s.dt_s, "up_axis"_a = s.up_axis, "continues_epoch"_a = s.continues_epoch,
        "continues_frame"_a = s.continues_frame);
  }

  [[nodiscard]] std::string body_name(std::uint32_t slot) const {
    std::array<char, TANDEM_BODY_NAME_SIZE> name{};
    check(unlocked([&] { return tandem_get_body_name(client_, slot, name.data(), name.size()); }));
    return name.data();
  }

  [[nodiscard]] py::list geometry() const {
    std::vector<tandem_solid> solids;
    check(unlocked([&] {
      return all_of(solids, TANDEM_SOLID_INIT, [this](auto* to, auto capacity, auto* count) {
        return tandem_get_geometry(client_, to, capacity, count);
      });
    }));
    py::list list;
    for (const tandem_solid& s : solids) {
      const auto triple = [](const float* from) { return py::make_tuple(from[0], from[1], from[2]); };
      const float* q = s.orientation;
      list.append(py::dict("shape"_a = s.shape, "centre"_a = triple(s.centre),
                           "orientation"_a = py::make_tuple(q[0], q[1], q[2], q[3]),
                           "half_size"_a = triple(s.half_size), "normal"_a = triple(s.normal),
                           "radius"_a = s.radius));
    }
    return list;
  }

  [[nodiscard]] py::list types() const {
    tandem_scene scene = TANDEM_SCENE_INIT;
    check(unlocked([&] { return tandem_get_scene(client_, &scene); }));
    py::list list;
    for (std::uint32_t index = 0; index < scene.type_count; ++index) {
      tandem_body_type t = TANDEM_BODY_TYPE_INIT;
      check(unlocked([&] { return tandem_get_type(client_, index, &t); }));
      py::array_t<float> values(t.value_count);
      std::size_t count = 0;
      float* const to = values.mutable_data();
      check(unlocked([&] { return tandem_get_type_values(client_, index, to, t.value_count, &count); }));
      list.append(py::dict("name"_a = t.name, "shape"_a = t.shape, "radius"_a = t.radius,
                           "colour_rgba"_a = t.colour_rgba, "values"_a = values));
    }
    return list;
  }

  /// Fills a vector with all that `get` lists, however many they become in between.
  template <class T, class Get>
  static tandem_result all_of(std::vector<T>& to, const T& empty, const Get& get) {
    std::size_t count = 0;
    tandem_result result = get(static_cast<T*>(nullptr), std::size_t{0}, &count);
    while (result == TANDEM_OK || result == TANDEM_CAPACITY) {
      if (count == 0) {
        to.clear();
        return TANDEM_OK;
      }
      to.assign(count, empty);
      result = get(to.data(), to.size(), &count);
      if (result == TANDEM_OK) {
        TANDEM_ASSERT(count <= to.size());
        to.resize(count);
        return TANDEM_OK;
      }
    }
    return result;
  }

 private:
  tandem_client client_ = 0;
  std::unique_ptr<py::function> log_;
};

/// Watches a domain.
class Browser {
 public:
  Browser(std::uint32_t domain, const std::string& profile, const std::string& secure) {
    tandem_options options = TANDEM_OPTIONS_INIT;
    options.domain = domain;
    options.profile = profile.c_str();
    options.secure = secure.c_str();
    check(unlocked([&] { return tandem_browser_open_with(&options, &browser_); }));
  }
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;
  ~Browser() {
    unlocked([this] { return tandem_browser_close(browser_); });
  }
  [[nodiscard]] py::list list() const {
    std::vector<tandem_session_info> sessions;
    check(unlocked([&] {
      return Connection::all_of(sessions, TANDEM_SESSION_INFO_INIT,
                                [this](auto* to, auto capacity, auto* count) {
                                  return tandem_browser_list(browser_, to, capacity, count);
                                });
    }));
    py::list list;
    for (const tandem_session_info& s : sessions) {
      list.append(py::dict(
          "name"_a = s.name, "scene"_a = s.scene, "codec"_a = s.codec, "predictor"_a = s.predictor,
          "playable"_a = s.playable != 0, "epoch"_a = s.epoch, "capacity"_a = s.capacity,
          "bodies"_a = s.bodies, "participants"_a = s.participants, "observers"_a = s.observers,
          "frame_rate_hz"_a = s.frame_rate_hz, "client_ms"_a = s.client_ms, "mbit_per_s"_a = s.mbit_per_s,
          "protocol_version"_a = s.protocol_version, "dt_s"_a = s.dt_s,
          "gravity"_a = py::make_tuple(s.gravity[0], s.gravity[1], s.gravity[2]), "up_axis"_a = s.up_axis,
          "continues_epoch"_a = s.continues_epoch, "continues_frame"_a = s.continues_frame));
    }
    return list;
  }

 private:
  tandem_browser browser_ = 0;
};

}  // namespace

PYBIND11_MODULE(_client, m) {
  m.def("version", &tandem_version);
  m.def("clock_ns", &tandem_clock_ns);
  py::class_<Connection>(m, "Connection")
      .def(py::init<std::uint32_t, const py::object&, tandem_role, std::uint32_t, bool, bool,
                    const std::string&, const std::string&, const std::string&, const std::string&,
                    const std::string&, const std::string&, std::uint32_t, std::optional<double>,
                    std::uint32_t, const py::object&>())
      .def("leave", &Connection::leave)
      .def("update", &Connection::update)
      .def("prefer", &Connection::prefer)
      .def("wait_until_playing", &Connection::wait_until_playing)
      .def("status", &Connection::status)
      .def("sample", &Connection::sample)
      .def("next_event", &Connection::next_event)
      .def("next_news", &Connection::next_news)
      .def("key", &Connection::key)
      .def("keys", &Connection::keys)
      .def("data_fields", &Connection::data_fields)
      .def("data", &Connection::data)
      .def("send_gravity", &Connection::send_gravity)
      .def("send_push", &Connection::send_push)
      .def("send_seek", &Connection::send_seek)
      .def("send_bytes", &Connection::send_bytes)
      .def("scene", &Connection::scene)
      .def("body_name", &Connection::body_name)
      .def("geometry", &Connection::geometry)
      .def("types", &Connection::types);
  py::class_<Browser>(m, "Browser")
      .def(py::init<std::uint32_t, const std::string&, const std::string&>())
      .def("list", &Browser::list);
}

}  // namespace tandem::python
