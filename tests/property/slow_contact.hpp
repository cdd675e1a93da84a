#pragma once
// The predicted step `contact` as idl/PROTOCOL.md, "Contact", says it: body by body in 64 bits, with a map of
// cells. Geometry of planes alone.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/drive.hpp"

namespace tandem {

class SlowContact {
 public:
  SlowContact(std::uint32_t capacity, ContactConstants constants) : constants_(std::move(constants)) {
    std::int64_t most = 1;
    for (const auto& type : constants_.types) most = std::max<std::int64_t>(most, type.radius);
    const auto bits = static_cast<std::int64_t>(std::bit_width(static_cast<std::uint64_t>(2 * most)));
    shift_ = std::max<std::int64_t>(0, bits - 14);
    width_ = (2 * most) >> shift_;
    while ((std::uint64_t{1} << (3 * side_bits_)) < 2 * std::uint64_t{capacity}) ++side_bits_;
  }

  void step(State& state, const StepInput& input) {
    wake(state, input.drive);
    find_pairs(state);
    for (std::int32_t substep = 0; substep < constants_.substeps; ++substep) {
      forces_.assign(state.capacity(), {});
      for (Slot s = 0; s < state.capacity(); ++s) {
        if (state.alive()[s] != 0) add_planes(state, s);
      }
      for (const auto& [a, b] : pairs_) add_pair(state, a, b);
      for (Slot s = 0; s < state.capacity(); ++s) {
        if (state.alive()[s] != 0 && state.rest()[s] == 0) move(state, input, s, substep == 0);
      }
    }
  }

 private:
  using Vec = std::array<std::int64_t, 3>;

  static void wake(State& state, const Drive& drive) {
    for (Slot s = 0; s < state.capacity(); ++s) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (state.c(i)[s] + drive.gravity[i] != 0) state.rest()[s] = 0;
      }
    }
  }

  [[nodiscard]] Vec speed_of(const State& state, Slot s) const {
    Vec v{};
    for (std::size_t i = 0; i < 3; ++i) v[i] = limited(state.v(i)[s] >> (shift_ + 6), (1 << 14) - 1);
    return v;
  }
  [[nodiscard]] std::int64_t radius_of(const State& state, Slot s) const {
    return constants_.type_of(state.type()[s]).radius;
  }
  static std::int64_t low_word(std::int64_t x) { return static_cast<std::int16_t>(x & 0xFFFF); }

  static Vec force(const ContactMaterial& material, std::int64_t depth, const Vec& n, const Vec& u) {
    const std::int64_t approach = (u[0] * n[0] + u[1] * n[1] + u[2] * n[2]) >> 11;
    const std::int64_t push =
        limited(((material.spring * depth) >> 11) + ((material.shear * approach) >> 11), (1 << 15) - 1);
    Vec f{};
    for (std::size_t i = 0; i < 3; ++i)
      f[i] = (((material.damping + material.shear) * u[i]) >> 9) - ((push * n[i]) >> 11);
    return f;
  }

  void add_planes(const State& state, Slot s) {
    for (const auto& plane : constants_.planes) {
      std::int64_t along = 0;
      for (std::size_t i = 0; i < 3; ++i) along += std::int64_t{plane.normal[i]} * state.p(i)[s];
      const std::int64_t height = radius_of(state, s) - ((along >> 30) - plane.offset);
      if (height <= 0) continue;
      Vec n{}, u = speed_of(state, s);
      for (std::size_t i = 0; i < 3; ++i) {
        n[i] = limited((-(plane.normal[i] >> 16)) >> 2, 1 << 12);
        u[i] = -u[i];
      }
      add(s, force(constants_.wall, std::min<std::int64_t>(height >> shift_, 1 << 14), n, u), 1);
    }
  }
  void add(Slot s, const Vec& f, std::int64_t sign) {
    for (std::size_t i = 0; i < 3; ++i) forces_[s][i] += sign * f[i];
  }

  void find_pairs(const State& state) {
    pairs_.clear();
    const std::int64_t cells = std::int64_t{1} << (3 * side_bits_);
    const std::int64_t row = std::int64_t{1} << side_bits_;
    std::map<std::int64_t, std::vector<Slot>> in_cell;
    for (Slot s = 0; s < state.capacity(); ++s) {
      if (state.alive()[s] == 0) continue;
      std::int64_t cell = 0;
      for (std::size_t i = 0; i < 3; ++i)
        cell += (((std::int64_t{state.p(i)[s]} >> shift_) * ((std::int64_t{1} << 32) / (width_ + 1))) >> 32)
                << (static_cast<std::int64_t>(i) * side_bits_);
      std::vector<Slot>& there = in_cell[cell & (cells - 1)];
      if (there.size() < 16) there.push_back(s);
    }
    for (const auto& [cell, there] : in_cell) {
      for (std::size_t i = 0; i < there.size(); ++i) {
        for (std::size_t k = i + 1; k < there.size(); ++k) find_pair(state, there[i], there[k]);
      }
      // Each pair of cells once: from the one behind.
      for (const std::int64_t ahead :
           {std::int64_t{1}, row - 1, row, row + 1, row * row - row - 1, row * row - row, row * row - row + 1,
            row * row - 1, row * row, row * row + 1, row * row + row - 1, row * row + row,
            row * row + row + 1}) {
        const auto other = in_cell.find((cell + ahead) & (cells - 1));
        if (other == in_cell.end()) continue;
        for (const Slot a : there) {
          for (const Slot b : other->second) find_pair(state, a, b);
        }
      }
    }
  }

  /// The square of the gap after a part of the frame, in 2^-15.
  [[nodiscard]] std::int64_t gap_squared(const State& state, Slot a, Slot b, std::int64_t part) const {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto at = [&](Slot s) {
        return (state.p(i)[s] + ((state.v(i)[s] * part) >> 21)) >> (shift_ + 5);
      };
      const std::int64_t gap = low_word(at(b) - at(a));
      sum += gap * gap;
    }
    return sum;
  }

  void find_pair(const State& state, Slot a, Slot b) {
    const std::int64_t substeps = constants_.substeps;
    const std::int64_t limit = ((width_ + (substeps > 1 ? width_ >> 5 : 0)) >> 5) + 3;
    const std::int64_t later = (1 << 15) - ((1 << 15) + substeps / 2) / substeps;
    if (gap_squared(state, a, b, 0) < limit * limit ||
        (substeps > 1 && gap_squared(state, a, b, later) < limit * limit))
      pairs_.emplace_back(a, b);
  }

  void add_pair(const State& state, Slot a, Slot b) {
    std::int64_t square = 0;
    Vec apart{};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int64_t p = state.p(i)[a], q = state.p(i)[b];
      apart[i] = low_word((q >> shift_) - (p >> shift_));
      square += apart[i] * apart[i];
    }
    const std::int64_t reach = (radius_of(state, a) >> shift_) + (radius_of(state, b) >> shift_);
    if (square >= reach * reach) return;
    const auto inverse = static_cast<std::int64_t>(
        (std::uint64_t{1} << 38) / square_root(static_cast<std::uint64_t>(2 * (square >> 16) + 1) << 31));
    const std::int64_t middle = (square + ((square >> 16) << 16) + (1 << 15)) >> 1;
    const std::int64_t depth = std::max<std::int64_t>(0, reach - (((middle >> 12) * inverse) >> 18));
    Vec n{0, 1 << 12, 0};
    const Vec of_a = speed_of(state, a);
    Vec u = speed_of(state, b);
    for (std::size_t i = 0; i < 3; ++i) {
      if (square != 0) n[i] = (apart[i] * inverse) >> 18;
      u[i] -= of_a[i];
    }
    const Vec f = force(constants_.pair, depth, n, u);
    add(a, f, 1);
    add(b, f, -1);
  }

  void move(State& state, const StepInput& input, Slot s, bool first) const {
    const std::int64_t substeps = constants_.substeps;
    const std::int64_t mobility = constants_.type_of(state.type()[s]).mobility;
    for (std::size_t i = 0; i < 3; ++i) {
      std::int32_t& p = state.p(i)[s];
      std::int32_t& v = state.v(i)[s];
      std::int32_t& c = state.c(i)[s];
      const std::int64_t pushed =
          share_of(limited(forces_[s][i] * (std::int64_t{1} << (shift_ + 2)), 1 << 26), mobility);
      std::int64_t next = v + pushed;
      if (first) {
        next += std::int64_t{input.drive.gravity[i]} + c;
        next -= share_of(next, input.drive.damping);
        c = limited(c - share_of(c, input.parameters.decay), kVelocityLimit);
      }
      v = limited(next, kVelocityLimit);
      const std::int64_t share = ((1 << 15) + substeps / 2) / substeps;
      p = limited(p + ((v * share + (1 << 20)) >> 21), kPositionLimit);
    }
  }

  ContactConstants constants_;
  std::int64_t shift_ = 0, width_ = 0, side_bits_ = 2;
  std::vector<Vec> forces_;                   // by slot
  std::vector<std::pair<Slot, Slot>> pairs_;  // of the frame
};

}  // namespace tandem
