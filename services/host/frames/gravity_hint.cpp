#include "services/host/frames/gravity_hint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tandem::host {
namespace {

double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

constexpr double kAlike = 0.1;      // of the change
constexpr double kFewOthers = 0.1;  // of the bodies, which meet something

}  // namespace

std::array<double, 3> GravityHint::common_change(const std::vector<Seen>& now) const {
  std::vector<std::array<double, 3>> changes;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (!now[i].alive || !before_[i].alive || now[i].reuse != before_[i].reuse) continue;
    auto& change = changes.emplace_back();
    for (std::size_t d = 0; d < 3; ++d)
      change[d] = static_cast<double>(now[i].v[d]) - static_cast<double>(before_[i].v[d]);
  }
  if (changes.size() < kLeastBodies) return {};
  std::array<double, 3> middle{};  // the median is that of most bodies
  for (std::size_t d = 0; d < 3; ++d) {
    const auto half = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
    std::ranges::nth_element(changes, half, {}, [d](const auto& change) { return change[d]; });
    middle[d] = (*half)[d];
  }
  const double size = distance(middle, {});
  const auto others = std::ranges::count_if(
      changes, [&](const auto& change) { return !(distance(change, middle) <= kAlike * size); });
  if (static_cast<double>(others) > kFewOthers * static_cast<double>(changes.size())) return {};
  return middle;
}

std::string GravityHint::look(const State& bodies) {
  if (told_) return {};
  const std::uint32_t every = std::max(1U, bodies.capacity() / kSample);
  std::vector<Seen> now;
  for (Slot s = 0; s < bodies.capacity() && now.size() < kSample; s += every)
    now.push_back(
        {bodies.alive()[s] != 0, bodies.reuse()[s], {bodies.v(0)[s], bodies.v(1)[s], bodies.v(2)[s]}});
  const std::array<double, 3> change =
      before_.size() == now.size() ? common_change(now) : std::array<double, 3>{};
  before_ = std::move(now);
  const double size = distance(change, {});
  const double per_second = size / lattice_.velocity_scale() / lattice_.dt_s;
  const bool matters = per_second / 2 > threshold_ * lattice_.unit;
  const bool same = distance(change, change_) <= kAlike * size;
  alike_ = matters ? (same ? alike_ : 0) + 1 : 0;
  change_ = change;
  if (alike_ < kAlikeFrames) return {};
  told_ = true;
  const double scale = 1 / (lattice_.velocity_scale() * lattice_.dt_s);
  return fmt::format(
      "all bodies accelerate alike, by ({:.3g}, {:.3g}, {:.3g}), but the simulation says that its gravity is 0: if it says "
      "this, frames take up to 2.8 times fewer bits",
      change[0] * scale, change[1] * scale, change[2] * scale);
}

}  // namespace tandem::host
