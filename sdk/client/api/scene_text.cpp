#include "sdk/client/api/scene_text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

namespace tandem::api {
namespace {

constexpr std::size_t kMostBytes = 1U << 20U;
constexpr int kMostLevels = 16;
constexpr std::size_t kMostFields = 100'000;

struct Field;
using Message = std::vector<Field>;

/// One value of a field: a message, or what stands in the text.
struct Field {
  std::string_view name;
  std::string_view scalar;  ///< as written; of strings side by side the first
  bool is_message = false;
  Message message = {};
};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Recursive descent. The first thing that is wrong ends it.
class Reader {
 public:
  explicit Reader(std::string_view text) : text_(text) {}

  Result<Message> read() {
    Message message;
    if (!fields(message, '\0', 0)) {
      const auto line = 1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n');
      return fail(ErrorCode::kMalformed, "the scene's text, line " + std::to_string(line) + ": " + wrong_);
    }
    return message;
  }

 private:
  bool wrong(const char* what) {
    wrong_ = what;
    return false;
  }
  [[nodiscard]] char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  void skip_space() {
    while (at_ < text_.size()) {
      if (text_[at_] == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (is_space(text_[at_])) {
        ++at_;
      } else {
        return;
      }
    }
  }
  bool take(char c) {
    skip_space();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  bool count_field() { return ++fields_ <= kMostFields || wrong("too many fields"); }

  /// Up to `end`, which is taken; 0 is the end of the text.
  bool fields(Message& message, char end, int depth) {
    if (depth > kMostLevels) return wrong("too many levels");
    for (;;) {
      skip_space();
      if (at_ == text_.size()) return end == '\0' || wrong("a message does not end");
      if (end != '\0' && take(end)) return true;
      if (!field(message, depth)) return false;
    }
  }

  bool field(Message& message, int depth) {
    const std::string_view name = word();
    if (name.empty()) return wrong("a field's name is missing");
    const bool colon = take(':');
    if (take('[')) {
      while (!take(']')) {
        if (!value(message, name, true, depth)) return false;
        take(',');
      }
    } else if (!value(message, name, colon, depth)) {
      return false;
    }
    if (!take(',')) take(';');
    return true;
  }

  bool value(Message& message, std::string_view name, bool scalar, int depth) {
    if (!count_field()) return false;
    Field& field = message.emplace_back();
    field.name = name;
    for (const auto& [begin, end] : {std::pair('{', '}'), std::pair('<', '>')}) {
      if (!take(begin)) continue;
      field.is_message = true;
      return fields(field.message, end, depth + 1);
    }
    if (!scalar) return wrong("':' or '{' is missing");
    skip_space();
    if (peek() == '"' || peek() == '\'') return strings(field.scalar);
    const std::size_t from = at_;
    if (peek() == '-' || peek() == '+') ++at_;
    while (is_letter(peek()) || is_digit(peek()) || peek() == '.' || is_exponent_sign(from)) ++at_;
    field.scalar = text_.substr(from, at_ - from);
    return at_ != from || wrong("a value is missing");
  }

  [[nodiscard]] bool is_exponent_sign(std::size_t from) const {
    return (peek() == '-' || peek() == '+') && at_ > from && (text_[at_ - 1] == 'e' || text_[at_ - 1] == 'E');
  }

  /// Nothing that is read here needs more than the first, without escapes resolved.
  bool strings(std::string_view& first) {
    bool some = false;
    for (skip_space(); peek() == '"' || peek() == '\''; skip_space()) {
      const char quote = text_[at_++];
      const std::size_t from = at_;
      while (at_ < text_.size() && text_[at_] != quote && text_[at_] != '\n')
        at_ += text_[at_] == '\\' ? std::size_t{2} : std::size_t{1};
      if (at_ >= text_.size() || text_[at_] != quote) {
        at_ = std::min(at_, text_.size());
        return wrong("a string does not end");
      }
      if (!std::exchange(some, true)) first = text_.substr(from, at_ - from);
      ++at_;
    }
    return true;
  }

  std::string_view word() {
    skip_space();
    const std::size_t from = at_;
    if (is_letter(peek())) {
      while (is_letter(peek()) || is_digit(peek())) ++at_;
    }
    return text_.substr(from, at_ - from);
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t fields_ = 0;
  const char* wrong_ = "";
};

// As protobuf, the last of several values counts.
const Field* last(const Message* message, std::string_view name) {
  if (message == nullptr) return nullptr;
  const auto found =
      std::find_if(message->rbegin(), message->rend(), [&](const Field& f) { return f.name == name; });
  return found == message->rend() ? nullptr : &*found;
}

const Message* child(const Message* message, std::string_view name) {
  const Field* field = last(message, name);
  return field != nullptr && field->is_message ? &field->message : nullptr;
}

std::string_view scalar(const Message* message, std::string_view name) {
  const Field* field = last(message, name);
  return field != nullptr && !field->is_message ? field->scalar : std::string_view();
}

/// Far from where a float would overflow, so that what is computed with it stays finite.
constexpr double kLargest = 1e30;

double number(const Message* message, std::string_view name) {
  std::string_view text = scalar(message, name);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string_view rest(end, static_cast<std::size_t>(text.data() + text.size() - end));
  const bool whole = error == std::errc() && (rest.empty() || rest == "f" || rest == "F");
  return whole && std::abs(value) <= kLargest ? value : 0;  // not of NaN
}

Vector vector(const Message* message) {
  return {number(message, "x"), number(message, "y"), number(message, "z")};
}

using Quaternion = std::array<double, 4>;  // x, y, z, w

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
          a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
          a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

Solid plane(const Message& text) {
  Solid solid;
  solid.shape = Solid::Shape::kPlane;
  solid.centre = vector(child(&text, "through"));
  solid.normal = vector(child(&text, "normal"));
  const double length = std::hypot(solid.normal[0], solid.normal[1], solid.normal[2]);
  for (double& x : solid.normal) x = length > 0 ? x / length : 0;
  return solid;
}

// Each turn is about an axis of the scene, so it comes in front of those before it.
Solid box(const Message& text) {
  Solid solid;
  solid.shape = Solid::Shape::kBox;
  solid.centre = vector(child(&text, "centre"));
  solid.size = vector(child(&text, "size"));
  for (const Field& field : text) {
    if (field.name != "turns" || !field.is_message) continue;
    const double half = std::atan2(number(&field.message, "rise"), number(&field.message, "run")) / 2;
    const std::string_view axis = scalar(&field.message, "axis");
    Quaternion turn{0, 0, 0, std::cos(half)};
    turn.at(axis == "y" ? 1 : axis == "z" ? 2 : 0) = std::sin(half);
    solid.orientation = product(turn, solid.orientation);
  }
  return solid;
}

Solid sphere(const Message& text) {
  Solid solid;
  solid.shape = Solid::Shape::kSphere;
  solid.centre = vector(child(&text, "centre"));
  solid.radius = number(&text, "radius_m");
  return solid;
}

bool add_solids(const Message& scene, std::string_view name, Solid (*make)(const Message&),
                std::vector<Solid>& solids) {
  std::size_t count = 0;
  for (const Field& field : scene) {
    if (field.name != name || !field.is_message) continue;
    if (++count > SceneText::kMostSolids) return false;
    const Solid solid = make(field.message);
    if (solid.shape == Solid::Shape::kPlane && solid.normal == Vector{}) continue;
    solids.push_back(solid);
  }
  return true;
}

}  // namespace

Result<SceneText> read_scene_text(std::string_view text) {
  if (text.size() > kMostBytes) return fail(ErrorCode::kMalformed, "the scene's text is longer than 1 MiB");
  const auto scene = Reader(text).read();
  if (!scene) return tl::unexpected<Error>(scene.error());
  SceneText out;
  out.gravity = vector(child(&*scene, "gravity"));
  out.max_gravity = number(&*scene, "max_gravity");
  const double gravity = std::hypot(out.gravity[0], out.gravity[1], out.gravity[2]);
  if (out.max_gravity == 0) out.max_gravity = 10 * gravity;  // idl/scene.proto
  out.max_push = number(&*scene, "max_push");
  const Message* bounds = child(&*scene, "bounds");
  out.low = vector(child(bounds, "low"));
  out.high = vector(child(bounds, "high"));
  if (!add_solids(*scene, "planes", plane, out.solids) || !add_solids(*scene, "boxes", box, out.solids) ||
      !add_solids(*scene, "spheres", sphere, out.solids)) {
    return fail(ErrorCode::kMalformed, "the scene's text has more than 4,096 solids of a kind");
  }
  return out;
}

}  // namespace tandem::api
