#include "services/host/frames/scene_check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <vector>

#include "services/program/number.hpp"

namespace tandem::host {
namespace {

using transport::TextField;
using transport::TextMessage;

/// A field that clients read: a message, or a number if it has no parts.
struct Field {
  std::string_view name;
  std::span<const Field> parts = {};
};
constexpr Field kVector[] = {{"x"}, {"y"}, {"z"}};
constexpr Field kPlane[] = {{"through", kVector}, {"normal", kVector}};
constexpr Field kTurn[] = {{"axis"}, {"rise"}, {"run"}};
constexpr Field kBox[] = {{"centre", kVector}, {"size", kVector}, {"turns", kTurn}};
constexpr Field kSphere[] = {{"centre", kVector}, {"radius_m"}};
constexpr Field kBounds[] = {{"low", kVector}, {"high", kVector}};
constexpr Field kScene[] = {{"planes", kPlane},   {"boxes", kBox}, {"spheres", kSphere}, {"bounds", kBounds},
                            {"gravity", kVector}, {"max_gravity"}, {"max_push"}};
constexpr std::string_view kOthers[] = {
    "number", "description", "dt_s",  "substeps",  "damping_per_s", "threshold_radii", "users",   "pair",
    "wall",   "types",       "start", "emitters",  "script",        "regions",         "engine",  "rigid",
    "towers", "rows",        "spare", "recording", "push_budget",   "sleep_speed",     "cruising"};

bool is_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  if (text.ends_with('f') || text.ends_with('F')) text.remove_suffix(1);
  const auto value = text::number<double>(text);
  return value && std::isfinite(*value);
}

std::string wrong_with(const TextField& field, const Field& known);

std::string wrong_with(const TextMessage& message, std::span<const Field> fields,
                       std::span<const std::string_view> others = {}) {
  for (const TextField& field : message) {
    const auto known = std::ranges::find(fields, field.name, &Field::name);
    if (known != fields.end()) {
      if (std::string wrong = wrong_with(field, *known); !wrong.empty()) return wrong;
    } else if (std::ranges::find(others, field.name) == others.end()) {
      std::vector<std::string_view> names;
      for (const Field& each : fields) names.push_back(each.name);
      return fmt::format("there is no field '{}'; {} are drawn", field.name, fmt::join(names, ", "));
    }
  }
  return {};
}

std::string wrong_with(const TextField& field, const Field& known) {
  const auto inside = [&](const std::string& what) { return fmt::format("{}: {}", field.name, what); };
  if (known.name == "axis") {
    const bool good = field.scalar == "x" || field.scalar == "y" || field.scalar == "z";
    return good ? std::string() : inside("must be \"x\", \"y\" or \"z\"");
  }
  if (known.parts.empty()) {
    if (!field.is_message && is_number(field.scalar)) return {};
    return inside(fmt::format("'{}' is not a finite number", field.is_message ? "{ ... }" : field.scalar));
  }
  if (!field.is_message) return inside(fmt::format("must be {{ ... }}, not '{}'", field.scalar));
  if (std::string wrong = wrong_with(field.message, known.parts); !wrong.empty()) return inside(wrong);
  if (known.parts.data() != kPlane) return {};
  const TextMessage* const normal = transport::child(&field.message, "normal");
  const auto is_zero = [](const TextField& each) {
    return each.scalar.find_first_of("123456789") == std::string_view::npos;
  };
  if (normal == nullptr || std::ranges::all_of(*normal, is_zero)) return inside("a plane needs a normal");
  return {};
}

}  // namespace

std::string wrong_with_scene(const TextMessage& scene) { return wrong_with(scene, kScene, kOthers); }

}  // namespace tandem::host
