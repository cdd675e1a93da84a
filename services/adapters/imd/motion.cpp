#include "services/adapters/imd/motion.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::imd {
namespace {

constexpr double kSmoothing = 0.2;
// From so many frames of the engine on, they are close enough together for a difference of second order.
constexpr double kClose = 3;

void smooth(double& mean, double value) { mean = mean > 0 ? mean + kSmoothing * (value - mean) : value; }

}  // namespace

Motion::Motion(const Topology& topology, const View& view) : view_(view) {
  if (topology.box) std::copy_n(topology.box->begin(), 3, box_.begin());
  const std::size_t atoms = topology.kind_of.size();
  for (std::size_t d = 0; d < 3; ++d) {
    columns_.position[d].assign(atoms, 0.0F);
    columns_.velocity[d].assign(atoms, 0.0F);
  }
  columns_.alive.assign(atoms, 1);
}

void Motion::show(const Newest& newest) {
  const bool first = shown_ == 0;
  if (!first) smooth(frames_a_show_, static_cast<double>(newest.number - shown_));
  shown_ = newest.number;
  if (newest.moment) {
    if (!first && newest.moment->time > shown_time_) smooth(time_a_show_, newest.moment->time - shown_time_);
    shown_time_ = newest.moment->time;
  }
  if (newest.box)
    for (std::size_t d = 0; d < 3; ++d) box_[d] = std::abs(double{(*newest.box)[4 * d]});
  const std::size_t atoms = columns_.alive.size();
  const bool own = newest.velocities.size() == 3 * atoms && time_a_show_ > 0;
  const bool differences = !own && newest.before.size() == 3 * atoms && frames_a_show_ > 0;
  const bool close = differences && frames_a_show_ >= kClose && newest.earlier.size() == 3 * atoms;
  // Scene units a second of viewers, of a unit of velocity, or of a difference between two frames.
  const double factor = view_.scale / view_.frame_s * (own ? time_a_show_ : frames_a_show_);
  for (std::size_t i = 0; i < atoms; ++i) {
    bool crossed = false;
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t at = 3 * i + d;
      const auto position = static_cast<float>(double{newest.now[at]} * view_.scale);
      double velocity = 0;
      if (own) velocity = double{newest.velocities[at]} * factor;
      if (differences) {
        const double one = double{newest.now[at]} - double{newest.before[at]};
        velocity = one * factor;
        if (close)
          velocity = (1.5 * one - 0.5 * (double{newest.before[at]} - double{newest.earlier[at]})) * factor;
      }
      // Who leaves a periodic box comes in on the other side, and did not fly across.
      if (!first && box_[d] > 0 &&
          std::abs(double{position} - double{columns_.position[d][i]}) > 0.5 * box_[d] * view_.scale)
        crossed = true;
      columns_.position[d][i] = position;
      columns_.velocity[d][i] = static_cast<float>(velocity);
    }
    if (!crossed) continue;
    columns_.alive[i] = static_cast<std::uint8_t>(columns_.alive[i] % 255 + 1);
    if (!own)
      for (auto& column : columns_.velocity) column[i] = 0;
  }
}

void Motion::hold() {
  for (auto& column : columns_.velocity) std::ranges::fill(column, 0.0F);
}

std::vector<std::int32_t> Motion::within(const std::array<double, 3>& centre, double radius) const {
  std::vector<std::int32_t> atoms;
  for (std::size_t i = 0; i < columns_.alive.size(); ++i) {
    double squared = 0;
    for (std::size_t d = 0; d < 3; ++d) {
      const double apart = double{columns_.position[d][i]} - centre[d];
      squared += apart * apart;
    }
    if (squared <= radius * radius) atoms.push_back(static_cast<std::int32_t>(i));
  }
  return atoms;
}

}  // namespace tandem::imd
