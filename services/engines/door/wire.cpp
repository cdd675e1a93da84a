#include "services/engines/door/wire.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

namespace tandem::engine::door {
namespace {

constexpr std::array<std::string_view, 14> kNames{"",       "HELLO", "LAYOUT", "START", "INPUT",
                                                  "STEP",   "DONE",  "SAVE",   "SAVED", "LOAD",
                                                  "LOADED", "ERROR", "BYE",    "NEWS"};
constexpr std::uint32_t kMaxCapacity = kMaxBodies;
constexpr std::size_t kMaxTypes = 65535, kMaxNameBytes = 64, kMaxSolids = 10'000, kMaxIgnored = 4;
constexpr double kFar = 1e9;
constexpr std::size_t kMaxAtOnce = std::size_t{16} << 20U;  // of bytes that are received

template <class T>
std::optional<T> number(std::string_view text) {
  T value{};
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  return value;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (!line.empty()) {
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) break;
    line.remove_prefix(begin);
    const std::size_t length = std::min(line.find_first_of(" \t\r"), line.size());
    words.push_back(line.substr(0, length));
    line.remove_prefix(length);
  }
  return words;
}

tl::unexpected<Error> malformed(std::string what) { return fail(ErrorCode::kMalformed, std::move(what)); }

/// One line of HELLO: a key and its values.
class Line {
 public:
  Line(std::string_view key, std::span<const std::string_view> values) : key_(key), values_(values) {}

  [[nodiscard]] std::size_t size() const { return values_.size(); }
  [[nodiscard]] std::string_view word(std::size_t i) const { return i < size() ? values_[i] : ""; }
  /// The value at `i`, within low .. high, which messages call `what`. After an error, 0.
  double real(std::size_t i, double low, double high, std::string_view what = {}) {
    const auto value = number<double>(word(i));
    if (value && *value >= low && *value <= high) return *value;
    refuse(fmt::format("{}'{}' is not a number of {:g} to {:g}", what.empty() ? "" : fmt::format("{} ", what),
                       word(i), low, high));
    return 0;
  }
  std::uint32_t whole(std::size_t i, std::uint32_t low, std::uint32_t high) {
    const auto value = number<std::uint32_t>(word(i));
    if (value && *value >= low && *value <= high) return *value;
    refuse(fmt::format("'{}' is not a whole number of {} to {}", word(i), low, high));
    return 0;
  }
  bool flag(std::size_t i) { return whole(i, 0, 1) == 1; }
  Vec3 vector(std::size_t i, double most) {
    return {real(i, -most, most), real(i + 1, -most, most), real(i + 2, -most, most)};
  }
  std::string name(std::size_t i) {
    const std::string_view text = word(i);
    const bool plain = std::ranges::all_of(text, [](char c) { return c > ' ' && c < 127; });
    if (text.empty() || text.size() > kMaxNameBytes || !plain)
      refuse(fmt::format("a name has 1 to {} printable characters", kMaxNameBytes));
    return std::string(text.substr(0, kMaxNameBytes));
  }
  void refuse(std::string why) {
    if (why_.empty()) why_ = fmt::format("the engine's line `{}`: {}", text(), why);
  }
  void need(std::size_t least, std::size_t most) {
    if (size() < least || size() > most)
      refuse(least == most ? fmt::format("takes {} values, not {}", least, size())
                           : fmt::format("takes {} to {} values, not {}", least, most, size()));
  }
  [[nodiscard]] const std::string& why() const { return why_; }
  /// For messages: a token stays secret.
  [[nodiscard]] std::string text() const {
    constexpr std::size_t kMaxShown = 80;
    std::string all(key_);
    for (const std::string_view value : values_) {
      if (key_ == "token" || all.size() + value.size() > kMaxShown) return all + " ...";
      all.append(" ").append(value);
    }
    return plain_line(std::as_bytes(std::span(all)));
  }

 private:
  std::string_view key_;
  std::span<const std::string_view> values_;
  std::string why_;
};

constexpr std::array<std::string_view, 6> kShapes{"", "sphere", "box", "capsule", "cylinder", "hull"};

void read_type(Line& line, Hello& hello) {
  line.need(2, 4 + 3 * 256);
  BodyType type;
  type.name = line.name(0);
  type.radius = line.real(1, 1e-9, kFar, "radius");
  if (line.size() > 2) {
    const std::string_view text = line.word(2);
    const char* const end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, type.colour_rgba, 16);
    if (text.size() != 8 || read.ec != std::errc() || read.ptr != end)
      line.refuse(fmt::format("'{}' is not a colour RRGGBBAA, such as FF8000FF", text));
  }
  if (line.size() > 3) type.mass = line.real(3, 1e-12, 1e12, "mass");
  if (line.size() > 4) {
    const auto shape = std::find(kShapes.begin() + 1, kShapes.end(), line.word(4));
    if (shape == kShapes.end())
      line.refuse(
          fmt::format("there is no shape '{}': sphere, box, capsule, cylinder or hull", line.word(4)));
    const auto kind = static_cast<std::uint32_t>(shape - kShapes.begin());
    type.shape = static_cast<BodyShape>(shape == kShapes.end() ? 1 : kind);
    for (std::size_t i = 5; i < line.size(); ++i)
      type.shape_values.push_back(static_cast<float>(line.real(i, -kFar, kFar)));
    const std::size_t values = type.shape_values.size();
    constexpr std::array<std::size_t, 5> kValues{0, 0, 3, 2, 2};
    if (type.shape == BodyShape::kHull) {
      if (values < 12 || values % 3 != 0)
        line.refuse(fmt::format("a hull has four or more points x y z, not {} values", values));
    } else if (const std::size_t wanted = kValues[static_cast<std::size_t>(type.shape)]; values != wanted) {
      line.refuse(fmt::format("a {} has {} shape values, not {}", line.word(4), wanted, values));
    }
  }
  if (hello.types.size() >= kMaxTypes) line.refuse(fmt::format("there are more than {} types", kMaxTypes));
  hello.types.push_back(std::move(type));
}

void read_input(Line& line, Hello& hello) {
  line.need(2, 2);
  if (line.word(0) == "gravity") {
    hello.most_gravity = line.real(1, 0, kFar);
  } else if (line.word(0) == "push") {
    hello.most_push = line.real(1, 0, kFar);
  } else if (line.word(0) == "application") {
    hello.most_bytes = line.whole(1, 0, 1024);
  }  // an unknown kind is one that this server cannot send
}

void read_tells(Line& line, NewsFeatures& tells) {
  line.need(1, 8);
  for (std::size_t i = 0; i < line.size(); ++i) {
    tells.keys = tells.keys || line.word(i) == "keys";
    tells.events = tells.events || line.word(i) == "events";
  }  // another word is one that this server does not know
}

std::string print_tells(const NewsFeatures& tells) {
  if (!tells.keys && !tells.events) return {};
  return fmt::format("news{}{}\n", tells.keys ? " keys" : "", tells.events ? " events" : "");
}

Scenery::Law read_law(Line& line, std::size_t i) {
  return {line.real(i, 0, kFar), line.real(i + 1, 0, kFar), line.real(i + 2, 0, kFar)};
}

void read_solid(std::string_view key, Line& line, Hello& hello) {
  Scenery& scenery = hello.scenery;
  if (key == "plane") {
    line.need(4, 4);
    scenery.planes.push_back({line.vector(0, kFar), line.real(3, -kFar, kFar)});
    double squared = 0;
    for (const double v : scenery.planes.back().normal) squared += v * v;
    if (!(std::abs(squared - 1) < 1e-3))
      line.refuse(fmt::format("the normal has length {:.4g}, not 1", std::sqrt(squared)));
  } else if (key == "box") {
    line.need(6, 6);
    scenery.boxes.push_back(
        {.centre = line.vector(0, kFar),
         .half = {line.real(3, 1e-9, kFar), line.real(4, 1e-9, kFar), line.real(5, 1e-9, kFar)}});
  } else {
    line.need(4, 4);
    scenery.balls.push_back({line.vector(0, kFar), line.real(3, 1e-9, kFar)});
  }
  if (scenery.planes.size() + scenery.boxes.size() + scenery.balls.size() > kMaxSolids)
    line.refuse(fmt::format("there are more than {} planes, boxes and balls", kMaxSolids));
}

void read_line(std::string_view key, Line& line, Hello& hello) {
  if (key == "name") {
    hello.name = line.name(0);
  } else if (key == "scene") {
    hello.scene = line.name(0);
  } else if (key == "session") {
    hello.session = line.name(0);
  } else if (key == "token") {
    line.need(1, 1);
    hello.token = line.word(0);
  } else if (key == "capacity") {
    hello.capacity = line.whole(0, 1, kMaxCapacity);
  } else if (key == "dt") {
    hello.dt_s = line.real(0, 1e-3, 1);
  } else if (key == "up") {
    if (line.size() != 1 || line.word(0).size() != 1 || line.word(0)[0] < 'x' || line.word(0)[0] > 'z')
      return line.refuse("must be x, y or z");
    hello.up_axis = static_cast<std::uint32_t>(line.word(0)[0] - 'x');
  } else if (key == "turns") {
    hello.turns = line.flag(0);
  } else if (key == "float") {
    hello.doubles = line.whole(0, 32, 64) == 64;
    if (line.word(0) != "32" && line.word(0) != "64") line.refuse("must be 32 or 64");
  } else if (key == "save") {
    hello.saves = line.flag(0);
  } else if (key == "memory") {
    hello.in_line = line.word(0) == "inline";
    if (!hello.in_line && line.word(0) != "shared") line.refuse("must be shared or inline");
  } else if (key == "gravity") {
    line.need(3, 3);
    hello.gravity = line.vector(0, kFar);
  } else if (key == "damping") {
    hello.damping_per_s = line.real(0, 0, 1e4);
  } else if (key == "step_limit") {
    hello.step_limit_s = line.real(0, kLeastLimitS, kMaxLimitS);
  } else if (key == "threshold") {
    hello.threshold = line.real(0, 1e-9, kFar);
  } else if (key == "extent") {
    hello.extent = line.real(0, 1e-6, kFar);
  } else if (key == "input") {
    read_input(line, hello);
  } else if (key == "news") {
    read_tells(line, hello.tells);
  } else if (key == "type") {
    read_type(line, hello);
  } else if (key == "plane" || key == "box" || key == "ball") {
    read_solid(key, line, hello);
  } else if (key == "law") {
    line.need(6, 7);
    hello.has_law = true;
    hello.scenery.between_bodies = read_law(line, 0);
    hello.scenery.with_scenery = read_law(line, 3);
    if (line.size() > 6) hello.scenery.substeps = line.whole(6, 1, 16);
  } else if (hello.ignored.size() < kMaxIgnored) {
    hello.ignored.push_back(line.text());
  }
}

Result<void> check_version(std::string_view text) {
  const std::size_t dot = text.find('.');
  const auto major = number<std::uint32_t>(text.substr(0, dot));
  const auto minor =
      dot == std::string_view::npos ? std::nullopt : number<std::uint32_t>(text.substr(dot + 1));
  if (!major || !minor) return malformed(fmt::format("engine: '{}' is not a version", text.substr(0, 40)));
  if (*major == kMajor) return {};
  return fail(ErrorCode::kUnsupported,
              fmt::format("the engine speaks version {} of the door, but this server {}.{}",
                          text.substr(0, 40), kMajor, kMinor));
}

Result<void> check_whole(const Hello& hello) {
  if (hello.capacity == 0) return malformed("the engine says no capacity");
  if (hello.dt_s == 0) return malformed("the engine says no dt");
  if (hello.damping_per_s * hello.dt_s >= 1)
    return malformed(fmt::format("a damping of {:g} takes all of the velocity in a step of {:g} s",
                                 hello.damping_per_s, hello.dt_s));
  return {};
}

template <class T>
T load(std::span<const std::byte> bytes, std::size_t offset) {
  static_assert(std::is_trivially_copyable_v<T>);
  T value{};
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

template <class T>
void store(std::vector<std::byte>& out, T value) {
  const auto bytes = std::as_bytes(std::span(&value, 1));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace

std::string name_of(Type type) {
  const auto number = static_cast<std::uint32_t>(type);
  return number == 0 || number >= kNames.size() ? fmt::format("type {}", number)
                                                : std::string(kNames[number]);
}

Result<Hello> parse_hello(std::string_view lines) {
  Hello hello;
  bool first = true;
  while (!lines.empty()) {
    const std::size_t length = std::min(lines.find('\n'), lines.size());
    const std::vector<std::string_view> words = words_of(lines.substr(0, length));
    lines.remove_prefix(std::min(length + 1, lines.size()));
    if (words.empty()) continue;
    if (first) {
      if (words[0] != "engine" || words.size() != 2)
        return malformed("HELLO does not begin with a line `engine 1.0`");
      if (auto good = check_version(words[1]); !good) return tl::unexpected(good.error());
      first = false;
      continue;
    }
    Line line(words[0], std::span(words).subspan(1));
    read_line(words[0], line, hello);
    if (!line.why().empty()) return malformed(line.why());
  }
  if (first) return malformed("HELLO is empty");
  if (auto good = check_whole(hello); !good) return tl::unexpected(good.error());
  if (hello.types.empty()) hello.types.emplace_back();
  return hello;
}

std::string print_hello(const Hello& hello) {
  std::string text = fmt::format("engine {}.{}\nname {}\ncapacity {}\ndt {}\nup {}\nturns {:d}\nfloat {}\n",
                                 kMajor, kMinor, hello.name, hello.capacity, hello.dt_s,
                                 "xyz"[std::min(hello.up_axis, 2U)], hello.turns, hello.doubles ? 64 : 32);
  const auto line = [&text]<class... T>(fmt::format_string<T...> form, T&&... values) {
    text += fmt::format(form, std::forward<T>(values)...) + '\n';
  };
  if (!hello.scene.empty()) line("scene {}", hello.scene);
  if (!hello.session.empty()) line("session {}", hello.session);
  line("gravity {} {} {}", hello.gravity[0], hello.gravity[1], hello.gravity[2]);
  line("damping {}", hello.damping_per_s);
  line("step_limit {}", hello.step_limit_s);
  line("save {:d}", hello.saves);
  line("memory {}", hello.in_line ? "inline" : "shared");
  if (hello.threshold) line("threshold {}", *hello.threshold);
  if (hello.extent) line("extent {}", *hello.extent);
  if (hello.most_gravity) line("input gravity {}", *hello.most_gravity);
  if (hello.most_push) line("input push {}", *hello.most_push);
  if (hello.most_bytes) line("input application {}", *hello.most_bytes);
  text += print_tells(hello.tells);
  for (const BodyType& type : hello.types) {
    std::string values;
    for (const float value : type.shape_values) values += fmt::format(" {}", value);
    line("type {} {} {:08X} {} {}{}", type.name, type.radius, type.colour_rgba, type.mass,
         kShapes[static_cast<std::size_t>(type.shape)], values);
  }
  for (const Scenery::Plane& plane : hello.scenery.planes)
    line("plane {} {} {} {}", plane.normal[0], plane.normal[1], plane.normal[2], plane.offset);
  for (const Scenery::Box& box : hello.scenery.boxes)
    line("box {} {} {} {} {} {}", box.centre[0], box.centre[1], box.centre[2], box.half[0], box.half[1],
         box.half[2]);
  for (const Scenery::Ball& ball : hello.scenery.balls)
    line("ball {} {} {} {}", ball.centre[0], ball.centre[1], ball.centre[2], ball.radius);
  if (hello.has_law) {
    const Scenery::Law &pair = hello.scenery.between_bodies, &wall = hello.scenery.with_scenery;
    line("law {} {} {} {} {} {} {}", pair.spring, pair.damping, pair.shear, wall.spring, wall.damping,
         wall.shear, hello.scenery.substeps);
  }
  return text;
}

Layout layout_of(const Hello& hello) {
  constexpr std::size_t kLine = 64, kPage = 4096;
  const auto up = [](std::size_t value, std::size_t unit) { return (value + unit - 1) / unit * unit; };
  Layout layout;
  layout.capacity = hello.capacity;
  layout.padded = static_cast<std::uint32_t>(up(hello.capacity, 16));
  layout.in_line = hello.in_line;
  layout.tells = hello.tells;
  std::size_t end = kSlotHeadBytes;
  const auto add = [&](std::string_view name, std::string_view kind, std::uint32_t axes, std::size_t bytes) {
    layout.columns.push_back({name, kind, axes, bytes, end});
    end = up(end + axes * bytes * layout.padded, kLine);
  };
  const std::string_view real = hello.doubles ? "f64" : "f32";
  const std::size_t real_bytes = hello.doubles ? 8 : 4;
  add("position", real, 3, real_bytes);
  add("velocity", real, 3, real_bytes);
  if (hello.turns) {
    add("orientation", real, 4, real_bytes);
    add("angular_velocity", real, 3, real_bytes);
  }
  add("alive", "u8", 1, 1);
  add("type", "u16", 1, 2);
  layout.slot_bytes = hello.in_line ? end : up(end, kPage);
  layout.first = hello.in_line ? 0 : kPage;
  return layout;
}

const Column& Layout::column(std::string_view name) const {
  const auto found = std::ranges::find(columns, name, &Column::name);
  return found == columns.end() ? columns.front() : *found;
}

std::string print_layout(const Layout& layout, std::string_view path) {
  std::string text =
      fmt::format("layout {}.{}\nmemory {}\n", kMajor, kMinor, layout.in_line ? "inline" : "shared");
  if (!layout.in_line) text += fmt::format("path {}\nbytes {}\n", path, layout.bytes());
  text += fmt::format("capacity {}\npadded {}\nslots {}\nfirst {}\nslot_bytes {}\n", layout.capacity,
                      layout.padded, layout.slots, layout.first, layout.slot_bytes);
  text += print_tells(layout.tells);
  for (const Column& column : layout.columns)
    text += fmt::format("column {} {} {} {}\n", column.name, column.kind, column.axes, column.offset);
  return text;
}

std::optional<Done> parse_done(std::span<const std::byte> body) {
  if (body.size() != kDoneBytes) return std::nullopt;
  return Done{load<std::uint64_t>(body, 0), load<std::uint32_t>(body, 8), load<std::uint32_t>(body, 12),
              load<std::uint64_t>(body, 16)};
}

std::optional<std::uint64_t> parse_saved(std::span<const std::byte> body) {
  if (body.size() < kSavedBytes) return std::nullopt;
  return load<std::uint64_t>(body, 0);
}

std::optional<Loaded> parse_loaded(std::span<const std::byte> body) {
  if (body.size() != kLoadedBytes) return std::nullopt;
  return Loaded{load<std::uint64_t>(body, 0), load<std::uint32_t>(body, 8)};
}

bool read_news(std::span<const std::byte> entries, const std::function<void(const NewsEntry&)>& take) {
  constexpr std::size_t kHead = 16;
  constexpr std::uint32_t kNoSlot = 0xFFFFFFFF;
  while (!entries.empty()) {
    if (entries.size() < kHead) return false;
    NewsEntry entry;
    entry.kind = static_cast<NewsEntry::Kind>(load<std::uint32_t>(entries, 0));
    const auto first = load<std::uint32_t>(entries, 4), slot = load<std::uint32_t>(entries, 8);
    const auto size = load<std::uint32_t>(entries, 12);
    entries = entries.subspan(kHead);
    if (size > entries.size()) return false;
    entry.bytes = entries.first(size);
    entries = entries.subspan(size);
    if (entry.kind == NewsEntry::Kind::kEvent) {
      entry.event = first;
      if (slot != kNoSlot) entry.slot = slot;
    } else if (entry.kind == NewsEntry::Kind::kKey || entry.kind == NewsEntry::Kind::kNoKey) {
      const std::size_t key_bytes = entry.kind == NewsEntry::Kind::kKey ? first : size;
      if (key_bytes > size) return false;
      entry.key = {reinterpret_cast<const char*>(entry.bytes.data()), key_bytes};  // NOLINT: a key is text
      entry.bytes = entry.bytes.subspan(key_bytes);
    } else {
      continue;
    }
    take(entry);
  }
  return true;
}

std::string plain_line(std::span<const std::byte> text) {
  constexpr std::size_t kMaxShown = 500;
  std::string line;
  for (const std::byte byte : text.first(std::min(text.size(), kMaxShown))) {
    const auto c = static_cast<char>(byte);
    if (c == '\n' && line.size() + 1 == text.size()) break;
    line += c >= ' ' && c < 127 ? c : '?';
  }
  return line;
}

void append(std::vector<std::byte>& out, Type type, std::span<const std::byte> body) {
  store(out, static_cast<std::uint32_t>(type));
  store(out, static_cast<std::uint32_t>(body.size()));
  out.insert(out.end(), body.begin(), body.end());
}

void append(std::vector<std::byte>& out, Type type, std::string_view body) {
  append(out, type, std::as_bytes(std::span(body)));
}

void append_input(std::vector<std::byte>& out, std::uint64_t frame, const Input& input) {
  const bool values = input.kind < static_cast<std::uint32_t>(InputKind::kApplication);
  const std::size_t count = values ? input.values.size() : input.bytes.size();
  store(out, static_cast<std::uint32_t>(Type::kInput));
  store(out, static_cast<std::uint32_t>(16 + (values ? 8 * count : count)));
  store(out, frame);
  store(out, input.kind);
  store(out, static_cast<std::uint32_t>(count));
  if (!values) {
    out.insert(out.end(), input.bytes.begin(), input.bytes.end());
    return;
  }
  for (const double value : input.values) store(out, value);
}

void append_step(std::vector<std::byte>& out, std::uint64_t frame, std::uint32_t slot) {
  store(out, static_cast<std::uint32_t>(Type::kStep));
  store(out, std::uint32_t{16});
  store(out, frame);
  store(out, slot);
  store(out, std::uint32_t{0});
}

void append_load(std::vector<std::byte>& out, std::uint64_t frame, std::span<const std::byte> from) {
  store(out, static_cast<std::uint32_t>(Type::kLoad));
  store(out, static_cast<std::uint32_t>(8 + from.size()));
  store(out, frame);
  out.insert(out.end(), from.begin(), from.end());
}

Result<std::span<std::byte>> Reader::room() {
  if (!wanted_ && held_ >= kHeadBytes) {
    const auto type = load<std::uint32_t>(bytes_, 0), length = load<std::uint32_t>(bytes_, 4);
    if (type == 0 || type >= kNames.size())
      return malformed(fmt::format("it sent a message of the unknown type {}", type));
    if (length > limit_)
      return malformed(fmt::format("its {} has {} bytes, but at most {} are allowed",
                                   name_of(static_cast<Type>(type)), length, limit_));
    wanted_ = kHeadBytes + length;
  }
  // A length alone costs no memory.
  const std::size_t end = std::min(wanted_.value_or(kHeadBytes), held_ + kMaxAtOnce);
  if (bytes_.size() < end) bytes_.resize(end);
  return std::span(bytes_).subspan(held_, end - held_);
}

std::vector<std::byte> Reader::exchange(std::vector<std::byte> other) {
  if (other.size() < kHeadBytes) other.resize(kHeadBytes);
  return std::exchange(bytes_, std::move(other));
}

std::optional<Reader::Message> Reader::take() {
  if (!wanted_ || held_ < *wanted_) return std::nullopt;
  Message message{static_cast<Type>(load<std::uint32_t>(bytes_, 0)),
                  std::span(bytes_).subspan(kHeadBytes, *wanted_ - kHeadBytes)};
  held_ = 0;
  wanted_.reset();
  return message;
}

}  // namespace tandem::engine::door
