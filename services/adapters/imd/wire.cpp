#include "services/adapters/imd/wire.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace tandem::imd {
namespace {

constexpr std::size_t kEnergyBytes = 40, kMomentBytes = 24, kBoxBytes = 36, kInfoBytes = 7;
constexpr int kOldest = 2, kNewest = 3;

std::uint32_t from_big(std::span<const std::byte> bytes) {
  std::uint32_t value = 0;
  for (const std::byte b : bytes.first(4)) value = value << 8U | std::to_integer<std::uint32_t>(b);
  return value;
}

template <class T>
T swapped_value(T value) {
  std::array<std::byte, sizeof(T)> bytes{};
  std::memcpy(bytes.data(), &value, sizeof value);
  std::ranges::reverse(bytes);
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

// The order of version 3 is that of the list; 0: not one of a frame.
std::int32_t place_of(Type type) {
  constexpr std::array kOrder{Type::kTime,        Type::kEnergies,   Type::kBox,
                              Type::kCoordinates, Type::kVelocities, Type::kForces};
  const auto found = std::ranges::find(kOrder, type);
  return found == kOrder.end() ? 0 : static_cast<std::int32_t>(found - kOrder.begin()) + 1;
}

}  // namespace

template <class T>
void EngineReader::copy(std::span<const std::byte> body, T* to, std::size_t count) const {
  std::memcpy(to, body.data(), count * sizeof(T));
  if (session_.swapped)
    for (T& value : std::span(to, count)) value = swapped_value(value);
}

Result<void> EngineReader::take(std::span<const std::byte> bytes,
                                const std::function<void(const Session&)>& on_session,
                                const std::function<void(Frame&)>& on_frame) {
  // Most bodies are larger than what a socket gives at once; held_ grows with what has come, not with what
  // was promised.
  const auto hold = [&](std::size_t wanted) {
    const auto more = bytes.first(std::min(bytes.size(), wanted - held_.size()));
    held_.insert(held_.end(), more.begin(), more.end());
    bytes = bytes.subspan(more.size());
    return held_.size() == wanted;
  };
  while (!bytes.empty()) {
    if (!has_head_) {
      if (!hold(kHeadBytes)) break;
      type_ = static_cast<Type>(from_big(held_));
      count_ = static_cast<std::int32_t>(from_big(std::span(held_).subspan(4)));
      if (state_ == State::kHandshake) {
        if (auto good = take_handshake(); !good) return good;
        held_.clear();
        if (state_ == State::kFrames) on_session(session_);
        continue;
      }
      has_head_ = true;
      held_.clear();
    }
    const auto wanted = body_bytes();
    if (!wanted) return tl::unexpected(wanted.error());
    if (!hold(*wanted)) break;
    has_head_ = false;
    if (auto good = take_message(held_, on_session, on_frame); !good) return good;
    held_.clear();
  }
  return {};
}

Result<void> EngineReader::take_handshake() {
  if (type_ != Type::kHandshake)
    return fail(ErrorCode::kMalformed,
                fmt::format("no IMD engine: its first message is of type {}, not 4 (handshake)",
                            static_cast<std::int32_t>(type_)));
  std::int32_t version = 0;
  std::memcpy(&version, held_.data() + 4, 4);
  session_.swapped = version < 0 || version > 0xFFFF;
  if (session_.swapped) version = swapped_value(version);
  if (version < kOldest || version > kNewest)
    return fail(ErrorCode::kUnsupported,
                fmt::format("the engine speaks version {} of IMD, but this program 2 and 3", version));
  session_.version = version;
  if (version == 2) session_.coordinates = session_.energies = true;
  state_ = version == 2 ? State::kFrames : State::kSessionInfo;
  return {};
}

Result<std::size_t> EngineReader::body_bytes() const {
  const auto of = [this](std::size_t most, std::size_t each) -> Result<std::size_t> {
    if (count_ < 0 || static_cast<std::uint32_t>(count_) != most)
      return fail(ErrorCode::kMalformed, fmt::format("a message of type {} with a count of {}, not {}",
                                                     static_cast<std::int32_t>(type_), count_, most));
    return most * each;
  };
  if (state_ == State::kSessionInfo && type_ != Type::kSessionInfo)
    return fail(ErrorCode::kMalformed,
                fmt::format("a message of type {} where version 3 has its session info",
                            static_cast<std::int32_t>(type_)));
  switch (type_) {
    case Type::kSessionInfo:
      if (state_ != State::kSessionInfo)
        return fail(ErrorCode::kMalformed, "a session info in the middle of the frames");
      return of(kInfoBytes, 1);
    case Type::kEnergies:
      return of(1, kEnergyBytes);
    case Type::kTime:
      return of(1, kMomentBytes);
    case Type::kBox:
      return of(1, kBoxBytes);
    case Type::kCoordinates:
    case Type::kVelocities:
    case Type::kForces:
      if (count_ < 0 || static_cast<std::uint32_t>(count_) != atoms_)
        return fail(ErrorCode::kCapacity,
                    fmt::format("the engine sends {} atoms, but the topology has {}", count_, atoms_));
      return std::size_t{12} * atoms_;
    case Type::kDisconnect:
    case Type::kIoError:
      return std::size_t{0};
    default:
      return fail(ErrorCode::kMalformed, fmt::format("a message of type {}, which no engine sends",
                                                     static_cast<std::int32_t>(type_)));
  }
}

Type EngineReader::last_of_frame() const {
  if (session_.forces) return Type::kForces;
  return session_.velocities ? Type::kVelocities : Type::kCoordinates;
}

Result<void> EngineReader::in_order(Type type) {
  const bool promised =
      (type == Type::kTime && session_.time) || (type == Type::kEnergies && session_.energies) ||
      (type == Type::kBox && session_.box) || (type == Type::kCoordinates && session_.coordinates) ||
      (type == Type::kVelocities && session_.velocities) || (type == Type::kForces && session_.forces);
  if (!promised)
    return fail(ErrorCode::kMalformed,
                fmt::format("a message of type {}, which the engine's session does not have",
                            static_cast<std::int32_t>(type)));
  if (session_.version == 2) return {};
  const std::int32_t place = place_of(type);
  if (place <= place_)
    return fail(ErrorCode::kMalformed, fmt::format("a message of type {} out of its order in a frame",
                                                   static_cast<std::int32_t>(type)));
  if (place > place_of(Type::kCoordinates) && place_ < place_of(Type::kCoordinates))
    return fail(ErrorCode::kMalformed, "a frame without coordinates");
  place_ = type == last_of_frame() ? 0 : place;
  return {};
}

Result<void> EngineReader::take_message(std::span<const std::byte> body,
                                        const std::function<void(const Session&)>& on_session,
                                        const std::function<void(Frame&)>& on_frame) {
  if (type_ == Type::kSessionInfo) {
    const auto flag = [&body](std::size_t i) { return body[i] != std::byte{0}; };
    session_.time = flag(0);
    session_.energies = flag(1);
    session_.box = flag(2);
    session_.coordinates = flag(3);
    session_.wrapped = flag(4);
    session_.velocities = flag(5);
    session_.forces = flag(6);
    if (!session_.coordinates)
      return fail(ErrorCode::kUnsupported,
                  "the engine's session has no coordinates; switch them on in its input");
    state_ = State::kFrames;
    on_session(session_);
    return {};
  }
  if (type_ == Type::kDisconnect || type_ == Type::kIoError)
    return fail(ErrorCode::kTransport,
                fmt::format("the engine ended the connection after {} frames", frame_.number));
  if (auto good = in_order(type_); !good) return good;
  const std::size_t values = std::size_t{3} * atoms_;
  if (type_ == Type::kTime) {
    Moment moment;
    copy(body, &moment.dt, 1);
    copy(body.subspan(8), &moment.time, 1);
    copy(body.subspan(16), &moment.step, 1);
    frame_.moment = moment;
  } else if (type_ == Type::kBox) {
    std::array<float, 9> box{};
    copy(body, box.data(), box.size());
    frame_.box = box;
  } else if (type_ == Type::kCoordinates) {
    frame_.positions.resize(values);
    copy(body, frame_.positions.data(), values);
  } else if (type_ == Type::kVelocities) {
    frame_.velocities.resize(values);
    copy(body, frame_.velocities.data(), values);
  }
  if (type_ == last_of_frame()) {
    ++frame_.number;
    on_frame(frame_);
  }
  return {};
}

void append_head(std::vector<std::byte>& out, Type type, std::int32_t value) {
  for (const auto number : {static_cast<std::uint32_t>(type), static_cast<std::uint32_t>(value)})
    for (int shift = 24; shift >= 0; shift -= 8)
      out.push_back(static_cast<std::byte>(number >> static_cast<unsigned>(shift)));
}

void append_forces(std::vector<std::byte>& out, std::span<const std::int32_t> atoms,
                   std::span<const float> forces, bool swapped) {
  append_head(out, Type::kForcesIn, static_cast<std::int32_t>(atoms.size()));
  const auto append_all = [&](const auto& values) {
    for (auto value : values) {
      if (swapped) value = swapped_value(value);
      const auto bytes = std::as_bytes(std::span(&value, 1));
      out.insert(out.end(), bytes.begin(), bytes.end());
    }
  };
  append_all(atoms);
  append_all(forces);
}

}  // namespace tandem::imd
