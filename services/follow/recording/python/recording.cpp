// tandem._recording: what a recording holds, for the Python class in sdk/python/tandem/recording.py.

#include <pybind11/stl.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "sdk/client/api/drawn_scene.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/python/module/columns.hpp"
#include "services/follow/recording/playback.hpp"
#include "tandem/body_shape.hpp"

namespace tandem::python {
namespace {

using namespace pybind11::literals;
using recording::Playback;
using Step = Playback::Step;

[[noreturn]] void raise(const Error& error) {
  raise_error(static_cast<std::int32_t>(error.code), error.message);
}

/// Writes `to.first[which]` of each body: what `value` makes of its index.
template <class T, class Value>
void put(const ArrayColumn<T>& to, std::size_t which, std::size_t bodies, const Value& value) {
  if (to.first == nullptr) return;
  auto* at = reinterpret_cast<std::byte*>(to.first + which);
  for (std::size_t i = 0; i < bodies; ++i, at += to.stride) *reinterpret_cast<T*>(at) = value(i);
}

/// The arrays that are wanted of a state.
struct Columns {
  ArrayColumn<float> positions, velocities, orientations, spins;
  ArrayColumn<TypeId> types;
  ArrayColumn<std::uint8_t> alive, reuse;

  /// Fills columns in scene units and seconds.
  void fill(const State& state, double unit, double rate_hz) const {
    const std::size_t bodies = state.capacity();
    const bool turning = state.groups().orientation;
    const auto scaled = [](std::span<const std::int32_t> from, double scale) {
      return [from, scale](std::size_t i) { return static_cast<float>(from[i] * scale); };
    };
    for (std::size_t i = 0; i < kPositionChannels; ++i) {
      put(positions, i, bodies, scaled(state.p(i), unit));
      put(velocities, i, bodies, scaled(state.v(i), unit * rate_hz / 64));  // from 1/64 unit a frame
    }
    for (std::size_t i = 0; i < kQuaternionChannels; ++i) {
      if (turning)
        put(orientations, i, bodies, scaled(state.q(i), 1.0 / kQuaternionOne));
      else
        put(orientations, i, bodies, [i](std::size_t) { return i == 3 ? 1.0F : 0.0F; });
    }
    for (std::size_t i = 0; i < kSpinChannels; ++i) {
      if (turning)
        put(spins, i, bodies, scaled(state.w(i), rate_hz / (1 << 28)));  // from 2^-28 rad a frame
      else
        put(spins, i, bodies, [](std::size_t) { return 0.0F; });
    }
    put(types, 0, bodies, [&](std::size_t i) { return state.type()[i]; });
    put(alive, 0, bodies, [&](std::size_t i) { return state.alive()[i]; });
    put(reuse, 0, bodies, [&](std::size_t i) { return state.reuse()[i]; });
  }
};

/// A playback that several threads may hold: each call is one turn, without the interpreter's lock.
class Reader {
  // Nothing of Python is touched within, so that a thread that holds the interpreter's lock never waits for a
  // turn.
  template <class Call>
  auto locked(const Call& call) {
    const py::gil_scoped_release release;
    const std::scoped_lock lock(mutex_);
    return call();
  }

 public:
  explicit Reader(std::string path) : path_(std::move(path)) {
    auto opened = locked([this] { return Playback::open(path_); });
    if (!opened) raise(opened.error());
    playback_ = std::move(*opened);
  }

  /// Goes to the next state. Returns None at the end, otherwise: whether the state starts a run, epoch,
  /// frame, hash, seconds since the first message, slots, whether it has orientations.
  [[nodiscard]] py::object next() {
    struct Place {
      bool starts;
      Epoch epoch;
      Frame frame;
      std::uint64_t hash;
      double time_s;
      std::uint32_t capacity;
      bool turning;
    };
    const auto read = locked([this]() -> Result<std::optional<Place>> {
      const auto step = playback_->next();
      holds_ = step && *step != Step::kEnd;
      if (!step) return tl::unexpected(step.error());
      if (!holds_) return std::nullopt;
      if (*step == Step::kStarted) session_ = playback_->session();
      return Place{*step == Step::kStarted,     playback_->session().epoch, timeline().applied(),
                   timeline().hash(),           playback_->time_s(),        state().capacity(),
                   state().groups().orientation};
    });
    if (!read) refuse(read.error());
    if (!*read) return py::none();
    const Place& s = **read;
    return py::make_tuple(s.starts, s.epoch, s.frame, s.hash, s.time_s, s.capacity, s.turning);
  }

  /// Goes to the place from which next() reaches a frame of an epoch soonest. False if there is no such
  /// epoch.
  bool seek(Epoch epoch, Frame frame) {
    const auto done = locked([&] {
      holds_ = false;
      return playback_->seek(epoch, frame);
    });
    if (!done) refuse(done.error());
    return *done;
  }

  /// Writes the current state. `arrays`: the columns in the order of tandem_columns, None for those that are
  /// not wanted; the last one, the changes, is ignored.
  void write(const py::tuple& arrays) {
    Columns to;
    to.positions = column_of<float>(arrays[0], "positions", 3);
    to.velocities = column_of<float>(arrays[1], "velocities", 3);
    to.orientations = column_of<float>(arrays[2], "orientations", 4);
    to.spins = column_of<float>(arrays[3], "angular_velocities", 3);
    to.types = column_of<TypeId>(arrays[4], "types", 1);
    to.alive = column_of<std::uint8_t>(arrays[5], "alive", 1);
    to.reuse = column_of<std::uint8_t>(arrays[6], "reuse", 1);
    const std::uint32_t rows = std::min({to.positions.bodies, to.velocities.bodies, to.orientations.bodies,
                                         to.spins.bodies, to.types.bodies, to.alive.bodies, to.reuse.bodies});
    const auto written = locked([&]() -> Result<void> {
      if (!holds_) return fail(ErrorCode::kOutOfOrder, "no state is at hand");
      if (rows < state().capacity())
        return fail(ErrorCode::kCapacity, "the session has " + std::to_string(state().capacity()) +
                                              " slots, more than the arrays have rows");
      to.fill(state(), playback_->session().lattice_unit, playback_->session().frame_rate_hz);
      return {};
    });
    if (!written) raise(written.error());
  }

  // The last state that next() returned:
  [[nodiscard]] Epoch epoch() {
    return locked([this] { return session_.epoch; });
  }
  [[nodiscard]] py::dict scene() {
    const transport::SessionMessage s = locked([this] { return session_; });
    const api::DrawnScene text = read_scene(s);
    const bool told = text.low != api::Vector{} || text.high != api::Vector{};
    return py::dict(
        "name"_a = s.scene, "capacity"_a = s.capacity, "frame_rate_hz"_a = s.frame_rate_hz,
        "gravity"_a = py::tuple(py::cast(s.gravity)), "max_gravity"_a = text.max_gravity,
        "max_push"_a = text.max_push, "dt_s"_a = s.dt_s, "up_axis"_a = static_cast<std::uint32_t>(s.up_axis),
        "continues_epoch"_a = s.continues_epoch, "continues_frame"_a = s.continues_frame,
        "bounds"_a =
            told ? py::object(py::make_tuple(py::tuple(py::cast(text.low)), py::tuple(py::cast(text.high))))
                 : py::none());
  }
  [[nodiscard]] py::list geometry() {
    constexpr auto kPlane = static_cast<int>(BodyShape::kHull) + 1;  // as tandem.h counts
    py::list list;
    for (const api::Solid& solid : read_scene(locked([this] { return session_; })).solids) {
      const int shape = solid.shape == api::Solid::Shape::kPlane ? kPlane
                        : solid.shape == api::Solid::Shape::kBox ? static_cast<int>(BodyShape::kBox)
                                                                 : static_cast<int>(BodyShape::kSphere);
      const auto& size = solid.size;
      list.append(py::dict("shape"_a = shape, "centre"_a = py::tuple(py::cast(solid.centre)),
                           "orientation"_a = py::tuple(py::cast(solid.orientation)),
                           "half_size"_a = py::make_tuple(size[0] / 2, size[1] / 2, size[2] / 2),
                           "normal"_a = py::tuple(py::cast(solid.normal)), "radius"_a = solid.radius));
    }
    return list;
  }
  [[nodiscard]] py::list types() {
    py::list list;
    for (const transport::BodyType& type : locked([this] { return session_.types; })) {
      const auto count = static_cast<py::ssize_t>(type.shape_values.size());
      list.append(py::dict("name"_a = type.name, "shape"_a = static_cast<int>(type.shape),
                           "radius"_a = type.radius, "colour_rgba"_a = type.colour_rgba,
                           "values"_a = py::array_t<float>(count, type.shape_values.data())));
    }
    return list;
  }

  [[nodiscard]] double length_s() const { return playback_->length_s(); }
  [[nodiscard]] std::optional<std::uint64_t> torn_at() const { return playback_->torn_at(); }
  [[nodiscard]] std::string left_out() {
    return locked([this] { return playback_->left_out(); });
  }

 private:
  [[nodiscard]] api::DrawnScene read_scene(const transport::SessionMessage& session) const {
    auto text = api::read_scene_json(session.scene_json);
    if (!text) refuse(text.error());
    return std::move(*text);
  }
  [[noreturn]] void refuse(const Error& error) const {
    raise(Error{error.code, path_ + ": " + error.message});
  }
  [[nodiscard]] const ClientTimeline& timeline() const { return playback_->timeline(); }
  [[nodiscard]] const State& state() const { return timeline().state(timeline().applied()); }

  const std::string path_;
  std::mutex mutex_;
  std::unique_ptr<Playback> playback_;
  bool holds_ = false;  // a state, for write()
  transport::SessionMessage session_;
};

}  // namespace

PYBIND11_MODULE(_recording, m) {
  py::class_<Reader>(m, "Reader")
      .def(py::init<std::string>())
      .def("next", &Reader::next)
      .def("seek", &Reader::seek)
      .def("write", &Reader::write)
      .def("epoch", &Reader::epoch)
      .def("scene", &Reader::scene)
      .def("geometry", &Reader::geometry)
      .def("types", &Reader::types)
      .def_property_readonly("length_s", &Reader::length_s)
      .def_property_readonly("torn_at", &Reader::torn_at)
      .def_property_readonly("left_out", &Reader::left_out);
  m.attr("nothing_to_play") = Playback::kNothingToPlay;
}

}  // namespace tandem::python
