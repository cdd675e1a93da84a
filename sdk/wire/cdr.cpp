#include "sdk/wire/cdr.hpp"

#include <array>
#include <bit>
#include <cstring>
#include <string>
#include <type_traits>

#include "sdk/wire/fields.hpp"

namespace tandem::transport {
namespace {

constexpr std::array<std::byte, kCdrHeaderBytes> kLittleEndianCdr{std::byte{0}, std::byte{1}, std::byte{0},
                                                                  std::byte{0}};

/// An unsigned integer of a primitive's size, with its bits.
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

/// Appends what it visits. Every primitive is at a multiple of its size, counted from the end of the header.
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

/// Fills what it visits. After impossible bytes everything that follows reads as zero and ok() is false.
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
    // The text has one NUL, at its end.
    ok_ = ok_ && !bytes.empty() && strnlen(from, bytes.size()) == bytes.size() - 1;
    value.assign(ok_ ? from : "");
  }
  void sequence(Bytes& values) {
    const std::span<const std::byte> bytes = take(length(), 1);
    values.assign(bytes.begin(), bytes.end());
  }
  // No memory is reserved: a count without as many elements ends at the first missing one.
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

void parameters(Writer& visit, const StreamParameters& values) {
  visit.sequence(list_parameters(values), [&](const Parameter& parameter) { fields(visit, parameter); });
}

void parameters(Reader& visit, StreamParameters& values) {
  std::vector<Parameter> all;
  visit.sequence(all, [&](Parameter& parameter) { fields(visit, parameter); });
  values = parameters_from(all).value_or(StreamParameters{});
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
  // The lowest two bits of the options count the bytes that fill up the last word.
  const std::size_t announced = std::to_integer<unsigned>(bytes[3]) & 3U;
  const bool whole = padding == Padding::kAny ? reader.remaining() <= 3 : reader.remaining() == announced;
  if (!whole) return refuse("bytes left over");
  if constexpr (std::is_same_v<M, SessionMessage>) complete_layouts(message);
  return message;
}

std::optional<std::uint32_t> session_version(std::span<const std::byte> bytes) {
  if (bytes.size() < kCdrHeaderBytes || bytes[0] != kLittleEndianCdr[0] || bytes[1] != kLittleEndianCdr[1])
    return std::nullopt;
  Reader reader(bytes.subspan(kCdrHeaderBytes));
  Epoch epoch = 0;
  std::uint32_t version = 0;
  primitives(reader, epoch, version);
  return reader.ok() ? std::optional(version) : std::nullopt;
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
template void write_cdr(const JournalMessage&, Bytes&);
template void write_cdr(const CheckpointMessage&, Bytes&);
template void write_cdr(const StandbyMessage&, Bytes&);
template void write_cdr(const CommandMessage&, Bytes&);
template Result<SessionMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<DeltaMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<ScheduledInputMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<SnapshotMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<ReplyMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<InputMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<AckMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<ServerStatusMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<ClientStatusMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<JournalMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<CheckpointMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<StandbyMessage> read_cdr(std::span<const std::byte>, Padding);
template Result<CommandMessage> read_cdr(std::span<const std::byte>, Padding);

}  // namespace tandem::transport
