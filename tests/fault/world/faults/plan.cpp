#include "tests/fault/world/faults/plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tests/fault/world/faults/engine_faults.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem::world {
namespace {

/// How a kind is drawn.
struct Shape {
  const char* name;
  double weight;  ///< among the kinds of a world
  double shortest_s, longest_s;
  double weakest, strongest;
};

// In the order of FaultKind.
constexpr std::array<Shape, kFaultKinds> kShapes{{
    {"crash", 1, 0, 3, 0, 0},
    {"leave", 0.7, 0, 3, 0, 0},
    {"power", 0.7, 0.1, 3, 0, 1},
    {"torn-write", 0.7, 0.1, 3, 0, 1},
    {"pause", 1, 0.02, 4, 0, 0},
    {"partition", 1, 0.05, 5, 0, 0},
    {"one-way", 1, 0.05, 5, 0, 0},
    {"isolate", 0.7, 0.05, 8, 0, 0},
    {"loss", 1, 0.2, 6, 0.01, 0.5},
    {"delay", 1, 0.2, 6, 0.005, 0.3},
    {"reorder", 1, 0.2, 6, 0.005, 0.2},
    {"duplicate", 0.5, 0.2, 6, 0.05, 1},
    {"thin", 0.7, 0.5, 8, 100, 1000},
    {"flip", 0.7, 0.2, 4, 0.001, 0.2},
    {"truncate", 2, 0.5, 8, 0.001, 0.3},
    {"forge", 0.7, 0.2, 10, 1, 40},
    {"slow-disk", 0.7, 0.5, 8, 0.02, 3},
    {"full-disk", 0.7, 0.2, 6, 0, 0},
    {"lost-fsync", 0.7, 0.2, 6, 0, 0},
    {"wall-jump", 0.7, 0, 0, -4000, 4000},
    {"drift", 0.5, 1, 20, -0.01, 0.01},
    {"starve", 1, 0.2, 5, 0.005, 0.6},
    {"starve-publisher", 0.7, 0.05, 2, 0, 0},
    {"burst", 1, 0, 0, 1, 100},
    {"newcomer", 1, 1, 20, 0, 0},
    {"quality", 0.5, 0, 0, 0, 0},
    {"preference", 0.7, 0, 0, 0, 0},
    {"lost-for-good", 1, 0.2, 6, 0.01, 0.3},
    {"handover", 0.7, 0.3, 2, 0, 0},
    {"hang", 0.7, 0.3, 6, 0, 0},
    {"repeat", 0.7, 0, 0, 0, 0},
    {"last-words", 1, 0.005, 0.12, 10, 120},
    {"squat", 0.4, 0, 0, 0, 0},
    {"engine-dies", 0, 0, 0, 0, 0},  // these two are drawn in engine_faults.cpp
    {"engine-stops", 0, 0, 0, 0, 0},
}};

/// Somebody starts anew. A world has these or losses for good, so that it shows what either does alone.
bool starts_anew(FaultKind kind) {
  return kind == FaultKind::kCrash || kind == FaultKind::kLeave || kind == FaultKind::kPower ||
         kind == FaultKind::kTornWrite || kind == FaultKind::kNewcomer || kind == FaultKind::kHandover ||
         kind == FaultKind::kHang || kind == FaultKind::kLastWords;
}

const Shape& shape_of(FaultKind kind) { return kShapes[static_cast<std::size_t>(kind)]; }

constexpr std::int64_t kAllAreIn = 2500;  // ms

}  // namespace

const char* name_of(FaultKind kind) { return shape_of(kind).name; }

std::string text_of(const Fault& fault) {
  char text[160];
  std::snprintf(text, sizeof text, "%u: %s of %u (%u) at %.3f s for %.3f s, strength %.4g", fault.id,
                name_of(fault.kind), fault.whom, fault.other, static_cast<double>(fault.at_ms) / 1e3,
                static_cast<double>(fault.for_ms) / 1e3, fault.strength);
  return text;
}

Plan draw_plan(std::uint64_t seed, const PlanWishes& wishes) {
  Dice dice(seed * 0x9E3779B97F4A7C15ULL + 3);
  std::vector<FaultKind> kinds, drawn = wishes.kinds;
  std::erase_if(drawn, of_an_engine);
  const double share = dice.uniform(0.15, 0.6);
  for (const FaultKind kind : drawn)
    if (dice.chance(share)) kinds.push_back(kind);
  if (kinds.empty() && !drawn.empty()) kinds.push_back(drawn[dice.below(drawn.size())]);
  if (kinds.empty()) return {};
  if (std::ranges::find(kinds, FaultKind::kLostForGood) != kinds.end()) {
    if (dice.chance(0.3)) {
      std::erase_if(kinds, starts_anew);
    } else if (kinds.size() > 1) {
      std::erase(kinds, FaultKind::kLostForGood);
    }
  }
  double weights = 0;
  for (const FaultKind kind : kinds) weights += shape_of(kind).weight;
  // From one in five seconds to three in a second.
  const double per_ms = 0.0002 * std::exp2(dice.uniform(0, 4));
  const double gentle = dice.uniform(0.2, 1);  // how strong and long faults are in this world
  Plan plan;
  const auto span_ms = static_cast<double>(wishes.until_ms - wishes.from_ms);
  const auto count = static_cast<std::uint32_t>(1 + span_ms * per_ms);
  for (std::uint32_t i = 0; i < count; ++i) {
    double at = dice.uniform(0, weights);
    FaultKind kind = kinds.back();
    for (const FaultKind other : kinds) {
      if (at < shape_of(other).weight) {
        kind = other;
        break;
      }
      at -= shape_of(other).weight;
    }
    const Shape& shape = shape_of(kind);
    Fault fault;
    fault.kind = kind;
    fault.at_ms = wishes.from_ms + (kind == FaultKind::kLostForGood ? kAllAreIn : 0) +
                  static_cast<std::int64_t>(dice.uniform(0, span_ms));
    // The server is hit as often as two others.
    fault.whom = dice.chance(0.25) ? 0 : static_cast<std::uint32_t>(dice.below(1000));
    fault.other = dice.chance(0.5) ? 0 : static_cast<std::uint32_t>(dice.below(1000));
    const double length = dice.uniform(0, 1);
    fault.for_ms = static_cast<std::int64_t>(
        1e3 * (shape.shortest_s + length * length * gentle * (shape.longest_s - shape.shortest_s)));
    const double strength = dice.uniform(0, 1);
    fault.strength = shape.weakest + strength * gentle * (shape.strongest - shape.weakest);
    if (shape.weakest < 0) fault.strength = dice.uniform(shape.weakest, shape.strongest) * gentle;
    fault.salt = dice.next();
    plan.push_back(fault);
  }
  std::ranges::stable_sort(plan, {}, &Fault::at_ms);
  for (std::uint32_t i = 0; i < plan.size(); ++i) plan[i].id = i;
  return plan;
}

Result<std::vector<FaultKind>> read_kinds(std::string_view text) {
  std::vector<FaultKind> kinds;
  if (text == "none") return kinds;
  for (std::size_t i = 0; i < kFaultKinds && text == "all"; ++i) kinds.push_back(static_cast<FaultKind>(i));
  if (text == "all") return kinds;
  while (!text.empty()) {
    const std::string_view name = text.substr(0, text.find(','));
    const auto found = std::ranges::find_if(kShapes, [&](const Shape& shape) { return name == shape.name; });
    if (found == kShapes.end()) {
      std::string known;
      for (const Shape& shape : kShapes) known += std::string(known.empty() ? "" : ",") + shape.name;
      return fail(ErrorCode::kInvalidArgument,
                  "no fault is called '" + std::string(name) + "'; there are all, none, " + known);
    }
    kinds.push_back(static_cast<FaultKind>(found - kShapes.begin()));
    text.remove_prefix(std::min(text.size(), name.size() + 1));
  }
  return kinds;
}

}  // namespace tandem::world
