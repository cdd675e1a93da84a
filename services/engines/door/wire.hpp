#pragma once
// The messages of idl/ENGINE.md as values: what they hold, and their bytes. Pure.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "tandem/body_shape.hpp"
#include "tandem/result.hpp"
#include "tandem/scenery.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine::door {

enum class Type : std::uint32_t {
  kHello = 1,
  kLayout = 2,
  kStart = 3,
  kInput = 4,
  kStep = 5,
  kDone = 6,
  kSave = 7,
  kSaved = 8,
  kLoad = 9,
  kLoaded = 10,
  kError = 11,
  kBye = 12,
  kNews = 13,
};
/// For people, such as "DONE"; "type 77" for an unknown one.
[[nodiscard]] std::string name_of(Type type);

inline constexpr std::size_t kHeadBytes = 8;           ///< type and length of a message
inline constexpr std::size_t kMaxBodyBytes = 1 << 16;  ///< of a message, without the slot of the inline form
/// Of what an engine on another machine saves.
inline constexpr std::size_t kMaxSavedBytes = std::size_t{1} << 30U;
inline constexpr std::uint32_t kMajor = 1, kMinor = 2;
/// Maximum body of all NEWS of a step: more than a session takes in many frames.
inline constexpr std::size_t kMaxStepNewsBytes = std::size_t{2} << 20U;

/// A type of bodies, as HELLO lists it.
struct BodyType {
  std::string name = "body";
  double radius = 0.5;
  std::uint32_t colour_rgba = 0xC0C0C0FF;
  double mass = 1;
  BodyShape shape = BodyShape::kSphere;
  std::vector<float> shape_values = {};
};

/// What an engine says of itself.
struct Hello {
  std::string name = "engine";
  std::string scene, session;  ///< empty: not said
  std::string token;           ///< of an engine that comes over the network; print_hello() leaves it out
  std::uint32_t capacity = 0;
  double dt_s = 0;
  std::uint32_t up_axis = 1;
  bool turns = false, doubles = false, saves = false, in_line = false;
  Vec3 gravity{};
  double damping_per_s = 0;
  double step_limit_s = 30;
  std::optional<double> threshold, extent;
  // The largest values of the inputs that it takes; empty: it takes none of that kind.
  std::optional<double> most_gravity, most_push;
  std::optional<std::uint32_t> most_bytes;
  NewsFeatures tells;  ///< NEWS may come
  std::vector<BodyType> types;
  bool has_law = false;  ///< scenery holds a law of contacts
  Scenery scenery;
  std::vector<std::string> ignored;  ///< the first few lines of keys that are not known
};
inline constexpr double kLeastLimitS = 0.1, kMaxLimitS = 3600;

/// Reads the lines of HELLO. Unknown keys are ignored. Errors: kMalformed, quoting the line; kUnsupported,
/// for another major version.
[[nodiscard]] Result<Hello> parse_hello(std::string_view lines);
/// The lines that parse_hello() reads, for engines that are made here.
[[nodiscard]] std::string print_hello(const Hello& hello);

/// Where a column lies in a slot.
struct Column {
  std::string_view name;
  std::string_view kind;  ///< f32, f64, u8 or u16
  std::uint32_t axes = 0;
  std::size_t element_bytes = 0;
  std::size_t offset = 0;  ///< from the slot's beginning; an axis is `padded` elements long
};

/// The form of the memory, which the server decides.
struct Layout {
  std::uint32_t capacity = 0, padded = 0;
  std::size_t first = 4096;  ///< offset of slot 0; 0 in the inline form
  std::size_t slot_bytes = 0;
  std::uint32_t slots = 1;
  bool in_line = false;
  NewsFeatures tells;  ///< of what HELLO says, what this server knows
  std::vector<Column> columns;

  [[nodiscard]] std::size_t bytes() const { return first + slots * slot_bytes; }
  [[nodiscard]] const Column& column(std::string_view name) const;
};
inline constexpr std::size_t kSlotHeadBytes = 64;  ///< begun, frame, done (u64), and 40 bytes of zero
[[nodiscard]] Layout layout_of(const Hello& hello);
/// The lines of LAYOUT; `path` is where the memory can be opened, empty in the inline form.
[[nodiscard]] std::string print_layout(const Layout& layout, std::string_view path);

/// One entry of NEWS.
struct NewsEntry {
  enum class Kind : std::uint32_t { kEvent = 1, kKey = 2, kNoKey = 3 };
  Kind kind = Kind::kEvent;
  std::uint32_t event = 0;            ///< kEvent: its kind
  std::optional<std::uint32_t> slot;  ///< kEvent: of the body that it is about
  std::string_view key;               ///< kKey, kNoKey; any bytes
  std::span<const std::byte> bytes;   ///< of the event, or the key's value
};
/// Hands the entries of a body of NEWS, behind its frame, to `take`, but for kinds that are not known. False:
/// an entry is longer than the body; those in front of it were handed over.
[[nodiscard]] bool read_news(std::span<const std::byte> entries,
                             const std::function<void(const NewsEntry&)>& take);

struct Done {
  std::uint64_t frame = 0;
  std::uint32_t slot = 0, colliding = 0;
  std::uint64_t step_ns = 0;
};
inline constexpr std::size_t kDoneBytes = 24, kSavedBytes = 8, kLoadedBytes = 16;
inline constexpr std::size_t kNewsBytes = 8;  ///< the frame, in front of the entries

struct Loaded {
  std::uint64_t frame = 0;
  std::uint32_t loaded = 0;
};

// Bodies of messages from the engine; empty if their size is wrong.
[[nodiscard]] std::optional<Done> parse_done(std::span<const std::byte> body);
/// Bytes that were saved; they follow behind kSavedBytes if the engine is on another machine.
[[nodiscard]] std::optional<std::uint64_t> parse_saved(std::span<const std::byte> body);
[[nodiscard]] std::optional<Loaded> parse_loaded(std::span<const std::byte> body);
/// Text for a log: one line of at most 500 bytes, without control characters.
[[nodiscard]] std::string plain_line(std::span<const std::byte> text);

// Whole messages to the engine, appended to `out`.
void append(std::vector<std::byte>& out, Type type, std::span<const std::byte> body);
void append(std::vector<std::byte>& out, Type type, std::string_view body);
void append_input(std::vector<std::byte>& out, std::uint64_t frame, const Input& input);
void append_step(std::vector<std::byte>& out, std::uint64_t frame, std::uint32_t slot);
/// `from`: the path of the file, or what is in it if the engine is on another machine.
void append_load(std::vector<std::byte>& out, std::uint64_t frame, std::span<const std::byte> from);

/// Cuts a stream of bytes into messages. It holds at most one message.
class Reader {
 public:
  struct Message {
    Type type = Type::kBye;
    std::span<const std::byte> body;  ///< valid until the next call
  };
  /// Maximum body from now on.
  void set_limit(std::size_t bytes) { limit_ = bytes; }
  /// Where the next bytes have to be written: at least one. Errors: kMalformed (an unknown type or a length
  /// beyond the limit); the stream cannot be read any further.
  [[nodiscard]] Result<std::span<std::byte>> room();
  /// That many bytes were written there.
  void filled(std::size_t bytes) {
    TANDEM_ASSERT(bytes <= bytes_.size() - held_);
    held_ += bytes;
  }
  /// The message that is whole now. Take it before the next room().
  [[nodiscard]] std::optional<Message> take();
  /// Gives the memory of the message that was taken last, and goes on with `other`.
  [[nodiscard]] std::vector<std::byte> exchange(std::vector<std::byte> other);
  /// Bytes of a message that is not whole.
  [[nodiscard]] std::size_t held() const { return held_; }

 private:
  std::vector<std::byte> bytes_ = std::vector<std::byte>(kHeadBytes);
  std::size_t held_ = 0;
  std::size_t limit_ = kMaxBodyBytes;
  std::optional<std::size_t> wanted_;  // bytes of the whole message, when its head is there
};

}  // namespace tandem::engine::door
