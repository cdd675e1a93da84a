#include "services/engines/door/inputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace tandem::engine::door {
namespace {

Classification refuse(std::string why) {
  Classification refused;
  refused.reason = std::move(why);
  return refused;
}

Classification immediate() {
  Classification effect;
  effect.effect = Classification::Effect::kImmediate;
  return effect;
}

/// Of the vector that begins at values[first].
double length(const Input& input, std::size_t first) {
  double squared = 0;
  for (std::size_t i = first; i < first + 3; ++i) squared += input.values[i] * input.values[i];
  return std::sqrt(squared);
}

Classification classify_gravity(const Hello& hello, const Input& input) {
  if (!hello.most_gravity) return refuse(hello.name + " takes no gravity");
  if (input.values.size() != 3 || !input.bytes.empty()) return refuse("gravity takes 3 values");
  if (!(length(input, 0) <= *hello.most_gravity))
    return refuse(fmt::format("gravity is at most {:g}", *hello.most_gravity));
  Classification effect;
  effect.effect = Classification::Effect::kScheduled;
  std::copy_n(input.values.begin(), 3, effect.gravity.begin());
  effect.damping_per_s = hello.damping_per_s;
  return effect;
}

Classification classify_push(const Hello& hello, const Input& input) {
  if (!hello.most_push) return refuse(hello.name + " takes no pushes");
  if (input.values.size() != 7 || !input.bytes.empty()) return refuse("a push takes 7 values");
  if (!(input.values[3] > 0)) return refuse("a push's radius must be above 0");
  if (!(length(input, 4) <= *hello.most_push))
    return refuse(fmt::format("a push is at most {:g}", *hello.most_push));
  return immediate();
}

Classification classify_application(const Hello& hello, const Input& input) {
  if (!hello.most_bytes) return refuse(hello.name + " takes no application bytes");
  if (!input.values.empty()) return refuse("an application's input has bytes only");
  if (input.bytes.size() > *hello.most_bytes)
    return refuse(fmt::format("an application's input has at most {} bytes", *hello.most_bytes));
  return immediate();
}

}  // namespace

Classification classify(const Hello& hello, const Input& input) {
  const bool finite = std::ranges::all_of(input.values, [](double v) { return std::isfinite(v); });
  if (!finite) return refuse("a value is not finite");
  switch (static_cast<InputKind>(input.kind)) {
    case InputKind::kGravity:
      return classify_gravity(hello, input);
    case InputKind::kPush:
      return classify_push(hello, input);
    case InputKind::kApplication:
      return classify_application(hello, input);
    default:
      return refuse(fmt::format("{} takes no input of kind {}", hello.name, input.kind));
  }
}

}  // namespace tandem::engine::door
