#include "sdk/transport/cdr.hpp"

#include <array>
#include <bit>
#include <cstring>
#include <string>
#include <type_traits>

namespace tandem::transport {
namespace {

constexpr std::array<std::byte, kCdrHeaderBytes> kLittleEndianCdr{std::byte{0}, std::byte{1}, std::byte{0},
                                                                  std::byte{0}};

/// An unsigned integer of a primitive's size, and its bits.
template <class T>
auto to_bits(T value) {
  if constexpr (std::is_same_v<T, double>) {
    return std::bit_cast<std::uint64_t>(value);
  } else if constexpr (std::is_same_v<T, float>) {
    return std::bit_cast<std::uint32_t>(value);
  } else if constexpr (std::is_enum_v<T>) {
    return to_bits(static_cast<std::underlying_type_t<T>>(value));
  } else {
    return static_cast<std::make_unsigned_t<T>>(value);
  }
}

template <class T>
T from_bits(decltype(to_bits(T{})) bits) {
  if constexpr (std::is_floating_point_v<T>) {
    return std::bit_cast<T>(bits);
  } else {
    return static_cast<T>(bits);
  }
}

/// Appends what it visits. Every primitive stands at a multiple of its size, counted from behind the header.
class Writer {
 public:
  explicit Writer(Bytes& out) : out_(out), start_(out.size() + kCdrHeaderBytes) {
    out_.insert(out_.end(), kLittleEndianCdr.begin(), kLittleEndianCdr.end());
  }

  template <class T>
  void primitive(const T& value) {
    const auto bits = to_bits(value);
    out_.resize(out_.size() + (0 - (out_.size() - start_)) % sizeof bits);
    for (std::size_t i = 0; i < sizeof bits; ++i) {
      out_.push_back(static_cast<std::byte>(bits >> (8U * i)));
    }
  }
  void text(const std::string& value) {
    const std::size_t length = std::strlen(value.c_str()) + 1;
    primitive(static_cast<std::uint32_t>(length));
    octets(value.c_str(), length);
  }
  void sequence(const Bytes& values) {
    primitive(static_cast<std::uint32_t>(values.size()));
    octets(values.data(), values.size());
  }
  template <class T, class Each>
  void sequence(const std::vector<T>& values, Each&& each) {
    primitive(static_cast<std::uint32_t>(values.size()));
    for (const T& value : values) each(value);
  }

 private:
  void octets(const void* from, std::size_t count) {
    const auto* const bytes = static_cast<const std::byte*>(from);
    out_.insert(out_.end(), bytes, bytes + count);
  }

  Bytes& out_;
  std::size_t start_;
};

/// Fills what it visits. After something impossible all that follows reads as zero and ok() is false.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> body) : in_(body) {}

  template <class T>
  void primitive(T& value) {
    decltype(to_bits(T{})) bits = 0;
    const std::span<const std::byte> bytes = take(sizeof bits, sizeof bits);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bits |= static_cast<decltype(bits)>(std::to_integer<decltype(bits)>(bytes[i]) << (8U * i));
    }
    value = from_bits<T>(bits);
  }
  void text(std::string& value) {
    const std::span<const std::byte> bytes = take(length(), 1);
    const auto* const from = reinterpret_cast<const char*>(bytes.data());
    // With its NUL, and no other.
    ok_ = ok_ && !bytes.empty() && strnlen(from, bytes.size()) == bytes.size() - 1;
    value.assign(ok_ ? from : "");
  }
  void sequence(Bytes& values) {
    const std::span<const std::byte> bytes = take(length(), 1);
    values.assign(bytes.begin(), bytes.end());
  }
  // Nothing is reserved: a count that is not followed by as many elements ends with the first that is
  // missing.
  template <class T, class Each>
  void sequence(std::vector<T>& values, Each&& each) {
    values.clear();
    for (std::uint32_t count = length(); count > 0 && ok_; --count) each(values.emplace_back());
  }

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t remaining() const { return in_.size() - at_; }

 private:
  std::uint32_t length() {
    std::uint32_t count = 0;
    primitive(count);
    return count;
  }
  std::span<const std::byte> take(std::size_t count, std::size_t alignment) {
    const std::size_t padding = (0 - at_) % alignment;
    ok_ = ok_ && remaining() >= padding && remaining() - padding >= count;
    if (!ok_) return {};
    at_ += padding + count;
    return in_.subspan(at_ - count, count);
  }

  std::span<const std::byte> in_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

template <class M, class T>
concept Is = std::is_same_v<std::remove_const_t<M>, T>;

template <class Visitor, class... Values>
void primitives(Visitor& visit, Values&... values) {
  (visit.primitive(values), ...);
}

template <class Visitor, class Values>
void numbers(Visitor& visit, Values& values) {
  visit.sequence(values, [&](auto& value) { visit.primitive(value); });
}

// Each message, field by field in the order of idl/tandem.idl.

template <class Visitor, Is<BodyType> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.radius, m.colour_rgba, m.shape);
  visit.text(m.name);
  numbers(visit, m.shape_values);
}

template <class Visitor, Is<Parameter> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.id, m.value);
}

void parameters(Writer& visit, const StreamParameters& values) {
  visit.sequence(list_parameters(values), [&](const Parameter& parameter) { fields(visit, parameter); });
}

void parameters(Reader& visit, StreamParameters& values) {
  std::vector<Parameter> all;
  visit.sequence(all, [&](Parameter& parameter) { fields(visit, parameter); });
  values = parameters_from(all).value_or(StreamParameters{});
}

template <class Visitor, Is<StreamMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.id.id, m.id.generation, m.layout.region_blocks, m.client_cost_ns, m.max_delta_bytes,
             m.max_snapshot_bytes, m.layout_hash);
  visit.text(m.layout.codec);
  visit.text(m.layout.predictor);
  visit.sequence(m.layout.groups, [&](auto& group) { visit.text(group); });
  numbers(visit, m.layout.radii);
  parameters(visit, m.layout.parameters);
  numbers(visit, m.layout.predictor_constants);
  visit.sequence(m.layout.codec_tables);
}

template <class Visitor, Is<SessionMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.protocol_version, m.capacity, m.frame_rate_hz, m.lattice_unit, m.lead,
             m.window_ceiling);
  visit.text(m.session);
  visit.text(m.scene);
  visit.text(m.scene_description);
  visit.sequence(m.types, [&](auto& type) { fields(visit, type); });
  visit.sequence(m.streams, [&](auto& stream) { fields(visit, stream); });
}

template <class Visitor, Is<DeltaMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.stream.id, m.stream.generation, m.frame, m.part, m.parts, m.last_input,
             m.server_time_ns, m.hash);
  visit.sequence(m.payload);
}

template <class Visitor, Is<ScheduledInputMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.number, m.frame, m.source_client, m.source_number, m.kind);
  numbers(visit, m.values);
}

template <class Visitor, Is<SnapshotMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.stream.id, m.stream.generation, m.frame, m.part, m.parts, m.total_bytes);
  visit.sequence(m.bytes);
}

template <class Visitor, Is<ReplyEntry> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.number, m.frame, m.code);
}

template <class Visitor, Is<ReplyMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.client, m.epoch, m.role, m.phase, m.reason, m.highest_input, m.client_clock_ns,
             m.server_time_ns);
  visit.sequence(m.entries, [&](auto& entry) { fields(visit, entry); });
}

template <class Visitor, Is<InputMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.client, m.epoch, m.number, m.client_frame, m.kind);
  numbers(visit, m.values);
  visit.sequence(m.bytes);
}

template <class Visitor, Is<AckMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.client, m.epoch, m.protocol_version, m.stream.id, m.stream.generation, m.phase,
             m.applied, m.simulated, m.role_wanted, m.join_attempt, m.clock_ns, m.snapshot_frame,
             m.snapshot_parts);
  numbers(visit, m.missing);
}

template <class Visitor>
auto figure(Visitor& visit) {
  return [&visit](const char* /*name*/, auto& value) { visit.primitive(value); };
}

template <class Visitor, Is<ServerStatusMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.frame);
  each_server_figure(figure(visit), m);
  primitives(visit, m.stream);
  visit.text(m.session);
  visit.text(m.codec);
  visit.text(m.predictor);
}

template <class Visitor, Is<ClientStatusMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.client, m.epoch, m.applied, m.stream.id, m.stream.generation, m.role, m.phase,
             m.too_slow, m.queue_high_water, m.lag_ms);
  each_reported_figure(figure(visit), m);
  visit.text(m.session);
}

}  // namespace

template <class M>
void write_cdr(const M& message, Bytes& out) {
  Writer writer(out);
  fields(writer, message);
}

template <class M>
Result<M> read_cdr(std::span<const std::byte> bytes, Padding padding) {
  const auto refuse = [](const char* why) {
    return fail(ErrorCode::kMalformed, std::string(M::kTopic) + ": " + why);
  };
  if (bytes.size() < kCdrHeaderBytes) return refuse("no encapsulation header");
  if (bytes[0] != kLittleEndianCdr[0] || bytes[1] != kLittleEndianCdr[1]) {
    return fail(ErrorCode::kUnsupported, std::string(M::kTopic) + ": not little-endian CDR");
  }
  Reader reader(bytes.subspan(kCdrHeaderBytes));
  M message;
  fields(reader, message);
  if (!reader.ok()) return refuse("truncated, or a text without its end");
  // The options' lowest two bits count the bytes that fill up the last word.
  const std::size_t announced = std::to_integer<unsigned>(bytes[3]) & 3U;
  const bool whole = padding == Padding::kAny ? reader.remaining() <= 3 : reader.remaining() == announced;
  if (!whole) return refuse("bytes left over");
  if constexpr (std::is_same_v<M, SessionMessage>) complete_layouts(message);
  return message;
}

template void write_cdr(const SessionMessage&, Bytes&);
template void write_cdr(const DeltaMessage&, Bytes&);
template void write_cdr(const ScheduledInputMessage&, Bytes&);
template void write_cdr(const SnapshotMessage&, Bytes&);
template void write_cdr(const ReplyMessage&, Bytes&);
template void write_cdr(const InputMessage&, Bytes&);
template void write_cdr(const AckMessage&, Bytes&);
template void write_cdr(const ServerStatusMessage&, Bytes&);
template void write_cdr(const ClientStatusMessage&, Bytes&);
template Result<SessionMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<DeltaMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<ScheduledInputMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<SnapshotMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<ReplyMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<InputMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<AckMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<ServerStatusMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<ClientStatusMessage> read_cdr(std::span<const std::byte>, Padding);

}  // namespace tandem::transport
