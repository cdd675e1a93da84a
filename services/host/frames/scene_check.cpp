#include "services/host/frames/scene_check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <span>
#include <vector>

#include "sdk/wire/json_reader.hpp"

namespace tandem::host {
namespace {

using transport::JsonReader;

/// A member that clients read: a message, a list of messages, or a number if it has no parts.
struct Field {
  std::string_view name;
  std::span<const Field> parts = {};
  bool is_list = false;
};
constexpr Field kVector[] = {{"x"}, {"y"}, {"z"}};
constexpr Field kPlane[] = {{"through", kVector}, {"normal", kVector}};
constexpr Field kTurn[] = {{"axis"}, {"rise"}, {"run"}};
constexpr Field kBox[] = {{"centre", kVector}, {"size", kVector}, {"turns", kTurn, true}};
constexpr Field kSphere[] = {{"centre", kVector}, {"radiusM"}};
constexpr Field kBounds[] = {{"low", kVector}, {"high", kVector}};
constexpr Field kScene[] = {{"planes", kPlane, true},
                            {"boxes", kBox, true},
                            {"spheres", kSphere, true},
                            {"bounds", kBounds},
                            {"gravity", kVector},
                            {"maxGravity"},
                            {"maxPush"}};
constexpr std::string_view kOthers[] = {
    "number", "description", "dtS",   "substeps",  "dampingPerS", "thresholdRadii", "users",   "pair",
    "wall",   "types",       "start", "emitters",  "script",      "regions",        "engine",  "rigid",
    "towers", "rows",        "spare", "recording", "pushBudget",  "sleepSpeed",     "cruising"};

/// Goes through one scene up to the first mistake.
class SceneCheck {
 public:
  explicit SceneCheck(std::string_view json) : in_(json) {}

  std::string wrong() {
    std::string wrong = wrong_with_members(kScene, kOthers);
    if (const auto whole = in_.finish(); !whole) return whole.error().message;
    return wrong;
  }

 private:
  std::string wrong_with_members(std::span<const Field> fields,
                                 std::span<const std::string_view> others = {}) {
    if (!in_.open_object()) return "must be an object, { ... }";
    bool has_normal = false;
    for (std::string name; in_.next_member(name);) {
      const auto known = std::ranges::find(fields, name, &Field::name);
      if (known != fields.end()) {
        if (name == "normal") not_zero_ = false;
        if (const std::string wrong = wrong_with(*known); !wrong.empty())
          return fmt::format("{}: {}", name, wrong);
        has_normal = has_normal || (name == "normal" && not_zero_);
      } else if (std::ranges::find(others, name) == others.end()) {
        std::vector<std::string_view> names;
        for (const Field& each : fields) names.push_back(each.name);
        return fmt::format("there is no member '{}'; {} are drawn", name, fmt::join(names, ", "));
      }
    }
    return fields.data() == kPlane && !has_normal ? "a plane needs a normal" : "";
  }

  std::string wrong_with(const Field& known) {
    if (known.name == "axis") {
      const auto axis = in_.text();
      return axis == "x" || axis == "y" || axis == "z" ? "" : "must be \"x\", \"y\" or \"z\"";
    }
    if (known.parts.empty()) {
      const auto value = in_.number();
      if (value) not_zero_ = not_zero_ || *value != 0;
      return value ? "" : "must be a finite number";
    }
    if (!known.is_list) return wrong_with_members(known.parts);
    if (!in_.open_array()) return "must be a list, [ ... ]";
    while (in_.next_item()) {
      if (std::string wrong = wrong_with_members(known.parts); !wrong.empty()) return wrong;
    }
    return {};
  }

  JsonReader in_;
  bool not_zero_ = false;  // some number of the member that is read
};

}  // namespace

std::string wrong_with_scene(std::string_view json) {
  return json.empty() ? std::string() : SceneCheck(json).wrong();
}

}  // namespace tandem::host
