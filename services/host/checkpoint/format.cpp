#include "services/host/checkpoint/format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <type_traits>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/wire/limits.hpp"

namespace tandem::checkpoint {
namespace {

static_assert(std::endian::native == std::endian::little, "engines save the machine's own layout");

constexpr std::uint64_t kMagic = 0x5450434D444E4154;  // "TANDMCPT"
constexpr std::uint16_t kByteOrder = 0x0102;
constexpr std::size_t kChecksumBytes = 8;

// Sections that a reader does not know are refused if this bit is set, and skipped otherwise.
constexpr std::uint32_t kCritical = 0x80000000;
enum class Section : std::uint32_t {
  kWorld = kCritical | 1U,
  kSlots = kCritical | 2U,
  kStreams = kCritical | 3U,
  kInputs = kCritical | 4U,
  kClients = kCritical | 5U,
  kEngine = kCritical | 6U,
  kNews = kCritical | 7U,  // only of a session with features
};
constexpr std::uint32_t kSections = 7;

constexpr std::size_t kMaxTextBytes = 4096;
constexpr std::size_t kMaxClients = 65536, kMaxInputs = 65536;

tl::unexpected<Error> malformed(std::string why) { return fail(ErrorCode::kMalformed, std::move(why)); }

/// Appends to a vector.
class FormatWriter {
 public:
  explicit FormatWriter(std::vector<std::byte>& out) : out_(&out) {}

  void bytes(const void* from, std::size_t size) {
    if (size == 0) return;
    const std::size_t at = out_->size();
    out_->resize(at + size);
    std::memcpy(out_->data() + at, from, size);
  }
  template <class T>
  void value(const T& v) {
    static_assert(std::is_arithmetic_v<T>);
    bytes(&v, sizeof v);
  }
  void text(const std::string& text) {
    fits_ = fits_ && text.size() <= kMaxTextBytes;
    value(static_cast<std::uint32_t>(text.size()));
    bytes(text.data(), text.size());
  }
  template <class T>
  void column(const std::vector<T>& values) {
    value(static_cast<std::uint64_t>(values.size()));
    bytes(values.data(), values.size() * sizeof(T));
  }
  template <class T, class Each>
  void list(const std::vector<T>& items, const Each& each, std::size_t most) {
    fits_ = fits_ && items.size() <= most;
    value(static_cast<std::uint64_t>(items.size()));
    for (const T& item : items) each(*this, item);
  }

  /// Nothing was longer than a reader takes.
  [[nodiscard]] bool fits() const { return fits_; }

 private:
  std::vector<std::byte>* out_;
  bool fits_ = true;
};

/// Reads what a writer wrote. Beyond the end it reads nothing, and ok() is false.
class FormatReader {
 public:
  explicit FormatReader(std::span<const std::byte> in) : in_(in) {}

  template <class T>
  void value(T& v) {
    static_assert(std::is_arithmetic_v<T>);
    copy(&v, sizeof v);
  }
  void text(std::string& text) {
    std::uint32_t size = 0;
    value(size);
    if (size > kMaxTextBytes || size > in_.size()) return spoil();
    text.resize(size);
    copy(text.data(), size);
  }
  template <class T>
  void column(std::vector<T>& values) {
    std::uint64_t size = 0;
    value(size);
    if (size > in_.size() / sizeof(T)) return spoil();
    values.resize(static_cast<std::size_t>(size));
    copy(values.data(), values.size() * sizeof(T));
  }
  template <class T, class Each>
  void list(std::vector<T>& items, const Each& each, std::size_t most) {
    std::uint64_t size = 0;
    value(size);
    if (size > most || size > in_.size()) return spoil();  // an item takes a byte at least
    items.resize(static_cast<std::size_t>(size));
    for (T& item : items) each(*this, item);
  }
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] bool at_end() const { return ok_ && in_.empty(); }
  [[nodiscard]] std::span<const std::byte> take(std::uint64_t size) {
    if (!ok_ || size > in_.size()) {
      spoil();
      return {};
    }
    const auto taken = in_.first(static_cast<std::size_t>(size));
    in_ = in_.subspan(taken.size());
    return taken;
  }

 private:
  void spoil() { ok_ = false; }
  void copy(void* to, std::size_t size) {
    if (!ok_ || in_.size() < size) return spoil();
    if (size > 0) std::memcpy(to, in_.data(), size);
    in_ = in_.subspan(size);
  }
  std::span<const std::byte> in_;
  bool ok_ = true;
};

// One list of fields for both directions, so that they cannot differ.

template <class Io, class I>
void each_field_of_input(Io& io, I& input) {
  io.value(input.kind);
  io.column(input.values);
  io.column(input.bytes);
}

template <class Io, class P>
void each_parameter(Io& io, P& parameters) {
  auto& codec = parameters.codec;
  io.value(codec.threshold);
  io.value(codec.position_step);
  io.value(codec.velocity_step);
  io.value(codec.velocity_gain);
  io.value(codec.acceleration_gain);
  io.value(codec.turn_step);
  io.value(codec.spin_step);
  io.value(parameters.step.decay);
}

template <class Io, class C>
void each_field(Io& io, C& c, Section section) {
  switch (section) {
    case Section::kWorld:
      for (auto* text : {&c.session, &c.scene, &c.engine, &c.program}) io.text(*text);
      io.value(c.epoch);
      io.value(c.frame);
      io.value(c.wall_ms);
      io.value(c.dt_s);
      io.value(c.lattice_unit);
      for (auto& g : c.gravity) io.value(g);
      io.value(c.damping_per_s);
      io.value(c.bodies);
      io.list(
          c.types, [](auto& to, auto& name) { to.text(name); }, transport::kMaxTypes);
      return;
    case Section::kSlots:
      io.column(c.next_reuse);
      io.column(c.withheld);
      return;
    case Section::kStreams:
      io.list(
          c.streams,
          [](auto& to, auto& stream) {
            to.text(stream.name);
            to.value(stream.layout_hash);
            to.value(stream.generation);
            each_parameter(to, stream.parameters);
          },
          transport::kMaxStreams);
      return;
    case Section::kInputs:
      io.value(c.last_input);
      io.list(
          c.scheduled,
          [](auto& to, auto& waiting) {
            to.value(waiting.number);
            to.value(waiting.frame);
            each_field_of_input(to, waiting.input);
          },
          kMaxInputs);
      io.list(
          c.immediate, [](auto& to, auto& input) { each_field_of_input(to, input); }, kMaxInputs);
      return;
    case Section::kClients:
      io.list(
          c.clients,
          [](auto& to, auto& client) {
            to.value(client.id);
            for (auto& byte : client.from.bytes) to.value(byte);
            to.value(client.highest);
            to.list(
                client.outcomes,
                [](auto& entries, auto& entry) {
                  entries.value(entry.number);
                  entries.value(entry.frame);
                  entries.value(entry.code);
                },
                transport::kReplyRing);
          },
          kMaxClients);
      return;
    case Section::kEngine:
      io.column(c.engine_state);
      return;
    case Section::kNews:
      io.column(c.world);
      io.column(c.waiting_news);
      return;
  }
}

bool known(std::uint32_t section) { return section > kCritical && section <= kCritical + kSections; }

// What the rest of the program relies on.
Result<void> check(const Checkpoint& c) {
  if (c.next_reuse.empty() || c.next_reuse.size() > kMaxCapacity)
    return malformed(fmt::format("it has {} slots", c.next_reuse.size()));
  if (c.withheld.size() != c.next_reuse.size()) return malformed("its columns of slots differ in length");
  if (c.epoch == 0 || c.epoch > kLastEpoch || c.frame > kLastFrame)
    return malformed(fmt::format("it is of frame {} of epoch {}", c.frame, c.epoch));
  std::uint64_t number = c.last_input - std::min<std::uint64_t>(c.last_input, c.scheduled.size());
  Frame frame = c.frame;
  for (const Scheduled& waiting : c.scheduled) {
    if (waiting.number != ++number || waiting.frame <= c.frame || waiting.frame < frame)
      return malformed("its scheduled inputs are not in order");
    frame = waiting.frame;
  }
  for (const StreamState& stream : c.streams)
    if (!valid_parameters(stream.parameters.codec))
      return malformed("a parameter of a stream is out of range");
  return {};
}

Result<Checkpoint> decode_version_1(std::span<const std::byte> body) {
  Checkpoint c;
  std::uint32_t found = 0;  // bit by section
  FormatReader reader(body);
  while (reader.ok() && !reader.at_end()) {
    std::uint32_t type = 0;
    std::uint64_t size = 0;
    reader.value(type);
    reader.value(size);
    FormatReader section(reader.take(size));
    if (!reader.ok()) break;
    if (!known(type)) {
      if ((type & kCritical) == 0) continue;
      return fail(ErrorCode::kUnsupported,
                  fmt::format("it has a section {} that this build does not know", type & ~kCritical));
    }
    const std::uint32_t bit = 1U << (type & ~kCritical);
    if ((found & bit) != 0) return malformed("it has a section twice");
    found |= bit;
    each_field(section, c, static_cast<Section>(type));
    if (!section.at_end()) return malformed(fmt::format("section {} cannot be read", type & ~kCritical));
  }
  if (!reader.ok()) return malformed("its sections do not fit the file");
  constexpr std::uint32_t kOptional = 1U << (static_cast<std::uint32_t>(Section::kNews) & ~kCritical);
  if ((found | kOptional) != ((1U << (kSections + 1)) - 2)) return malformed("a section is missing");
  if (auto good = check(c); !good) return tl::unexpected(good.error());
  return c;
}

}  // namespace

Result<void> encode(const Checkpoint& checkpoint, std::vector<std::byte>& out) {
  out.clear();
  FormatWriter writer(out);
  writer.value(kMagic);
  writer.value(kByteOrder);
  writer.value(kFormatVersion);
  writer.value(std::uint8_t{0});
  writer.value(std::uint32_t{0});
  writer.value(std::uint64_t{0});  // the length of the file, known below
  const auto put = [&out](std::size_t at, std::uint64_t value) {
    std::memcpy(&out[at], &value, sizeof value);
  };
  for (std::uint32_t i = 1; i <= kSections; ++i) {
    if (static_cast<Section>(kCritical | i) == Section::kNews && checkpoint.world.empty()) continue;
    writer.value(kCritical | i);
    const std::size_t at = out.size();
    writer.value(std::uint64_t{0});
    each_field(writer, checkpoint, static_cast<Section>(kCritical | i));
    if (!writer.fits())
      return fail(ErrorCode::kInvalidArgument,
                  fmt::format("section {} of it would be too long to be read", i));
    put(at, out.size() - at - sizeof(std::uint64_t));
  }
  put(16, out.size() + kChecksumBytes);
  writer.value(hash_bytes(out));
  if (out.size() > kMaxFileBytes)
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("it would have {} bytes, and at most {} are read", out.size(), kMaxFileBytes));
  return check(checkpoint).map_error([](Error error) {
    error.code = ErrorCode::kInvalidArgument;
    return error;
  });
}

Result<Checkpoint> decode(std::span<const std::byte> file) {
  if (file.empty()) return malformed("it is empty");
  FormatReader head(file);
  std::uint64_t magic = 0, length = 0;
  std::uint16_t order = 0;
  std::uint8_t version = 0, reserved = 0;
  std::uint32_t reserved_too = 0;
  head.value(magic);
  if (head.ok() && magic != kMagic) return malformed("it is no checkpoint");
  head.value(order);
  head.value(version);
  head.value(reserved);
  head.value(reserved_too);
  head.value(length);
  if (!head.ok()) return malformed(fmt::format("it is cut short after {} bytes", file.size()));
  if (order != kByteOrder)
    return fail(ErrorCode::kUnsupported, "it was written by a machine of another byte order");
  if (version != kFormatVersion) {
    return fail(
        ErrorCode::kUnsupported,
        fmt::format("it has format version {}, and this build reads version {}", version, kFormatVersion));
  }
  if (length != file.size())
    return malformed(fmt::format("it says that it has {} bytes, but it has {}", length, file.size()));
  if (length < kHeadBytes + kChecksumBytes) return malformed("it is too short");
  std::uint64_t sum = 0;
  FormatReader(file.last(kChecksumBytes)).value(sum);
  const auto sealed = file.first(file.size() - kChecksumBytes);
  if (sum != hash_bytes(sealed)) return malformed("its checksum is wrong");
  return decode_version_1(sealed.subspan(kHeadBytes));
}

}  // namespace tandem::checkpoint
