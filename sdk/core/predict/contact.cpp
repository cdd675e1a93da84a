// The tier `contact`: v += g + c + contact forces, then as `ballistic`. Forces are those of the state at the
// start of a sub-step, of S. Green, "Particle Simulation using CUDA" (2008):
//   (damping + shear) * u - (spring * overlap + shear * (u.n)) * n
#include "sdk/core/predict/contact.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/predict/contact_walls.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kReachBits = 14;  // two bodies that touch are less than 2^14 grid units apart
constexpr std::uint32_t kRootShift = 16;
constexpr std::size_t kRoots = std::size_t{1} << (2 * kReachBits - kRootShift);
constexpr std::uint32_t kDead = UINT32_MAX;

// With n in 2^-14 and `overlap` in 1/64 lattice unit, both towards the body's own side: the change of v.
// |u| <= 2^29, |n| < 2^15, gains <= 2^20, overlap < 2^38: every product stays below 2^60.
std::array<std::int64_t, 3> penalty(const ContactMaterial& material, std::int64_t overlap, const Vec3i& n,
                                    const std::array<std::int64_t, 3>& u) {
  const std::int64_t closing = (u[0] * n[0] + u[1] * n[1] + u[2] * n[2]) >> 14;
  const std::int64_t push = (material.spring * overlap - material.shear * closing) >> 16;
  const std::int64_t drag = std::int64_t{material.damping} + material.shear;
  std::array<std::int64_t, 3> force{};
  for (std::size_t i = 0; i < 3; ++i) force[i] = ((push * n[i]) >> 14) + ((drag * u[i]) >> 16);
  return force;
}

// Every grid needs four cells a side, or the cells before and behind one would be the same.
std::uint32_t side_bits_for(std::uint32_t capacity) {
  std::uint32_t bits = 2;
  while ((1U << (3 * bits)) < 2 * capacity) ++bits;
  return bits;
}

constexpr std::array<std::array<std::int32_t, 2>, 4> kRowsAhead{{{1, 0}, {-1, 1}, {0, 1}, {1, 1}}};  // y, z

}  // namespace

Result<std::unique_ptr<Predictor>> Contact::create(std::uint32_t capacity,
                                                   std::span<const std::int32_t> constants) {
  return read_contact_constants(constants).map([&](ContactConstants&& read) {
    return std::unique_ptr<Predictor>(std::make_unique<Contact>(capacity, std::move(read)));
  });
}

Contact::Contact(std::uint32_t capacity, ContactConstants constants)
    : constants_(std::move(constants)),
      side_bits_(side_bits_for(capacity)),
      cell_(capacity),
      begin_((std::size_t{1} << (3 * side_bits_)) + 1),
      end_(begin_.size()),
      sorted_(capacity),
      force_(capacity),
      inverse_root_(kRoots) {
  std::uint32_t largest = 1;
  for (const auto& type : constants_.types)
    largest = std::max(largest, static_cast<std::uint32_t>(type.radius));
  const auto bits = static_cast<std::uint32_t>(std::bit_width(2 * largest));
  shift_ = bits > kReachBits ? bits - kReachBits : 0;
  cells_per_ = (std::int64_t{1} << 32) / ((std::int64_t{2} * largest >> shift_) + 1);
  move_ = (65536 + constants_.substeps / 2) / constants_.substeps;
  for (std::size_t i = 0; i < kRoots; ++i) {
    // r at the middle of the entry, in 2^-8.
    const std::int64_t r = root(((2 * std::uint64_t{i} + 1) << (kRootShift - 1)) << 16U);
    inverse_root_[i] = static_cast<std::uint32_t>((std::int64_t{1} << 38) / r);
  }
}

std::uint32_t Contact::cell_of(const State& state, Slot slot) const {
  const std::uint32_t mask = (1U << side_bits_) - 1;
  std::uint32_t cell = 0;
  for (std::size_t i = 3; i-- > 0;) {
    const auto along = static_cast<std::uint32_t>((state.p(i)[slot] >> shift_) * cells_per_ >> 32);
    cell = (cell << side_bits_) | (along & mask);
  }
  return cell;
}

void Contact::sort_into_grid(const State& state) {
  std::fill(begin_.begin(), begin_.end(), 0U);
  const std::uint32_t capacity = state.capacity();
  for (Slot s = 0; s < capacity; ++s) {
    cell_[s] = state.alive()[s] != 0 ? cell_of(state, s) : kDead;
    if (cell_[s] != kDead) ++begin_[cell_[s] + 1];
  }
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
  std::copy(begin_.begin(), begin_.end(), end_.begin());
  for (Slot s = 0; s < capacity; ++s) {
    if (cell_[s] == kDead) continue;
    Record& record = sorted_[end_[cell_[s]]++];
    record.radius = type_of(state, s).radius;
    record.slot = s;
    for (std::size_t i = 0; i < 3; ++i) {
      record.q[i] = state.p(i)[s] >> shift_;
      record.v[i] = state.v(i)[s];
    }
  }
  for (std::size_t c = 0; c + 1 < begin_.size(); ++c) end_[c] = std::min(end_[c], begin_[c] + kMostInCell);
}

void Contact::add_walls(const State& state) {
  for (Slot s = 0; s < state.capacity(); ++s) {
    Force& force = force_[s];
    force = {};
    if (state.alive()[s] == 0) continue;
    const std::int32_t radius = type_of(state, s).radius;
    const Vec3i p{state.p(0)[s], state.p(1)[s], state.p(2)[s]};
    const Force u{-std::int64_t{state.v(0)[s]}, -std::int64_t{state.v(1)[s]}, -std::int64_t{state.v(2)[s]}};
    const auto add = [&](const auto& shapes) {
      for (const auto& shape : shapes) {
        const WallTouch t = touch(shape, p, radius);
        if (t.overlap <= 0) continue;
        const Force f = penalty(constants_.wall, t.overlap << 6, t.out, u);
        for (std::size_t i = 0; i < 3; ++i) force[i] += f[i];
      }
    };
    add(constants_.planes);
    add(constants_.boxes);
    add(constants_.balls);
  }
}

// Seen from the lower slot, so that rounding does not depend on the order of the grid.
void Contact::add_pair(std::uint32_t first, std::uint32_t second) {
  if (sorted_[first].slot > sorted_[second].slot) std::swap(first, second);
  const Record& a = sorted_[first];
  const Record& b = sorted_[second];
  std::uint32_t squared = 0;
  Vec3i d{};
  Force u{};
  for (std::size_t i = 0; i < 3; ++i) {
    d[i] = a.q[i] - b.q[i];
    squared += static_cast<std::uint32_t>(d[i] * d[i]);
    u[i] = std::int64_t{b.v[i]} - a.v[i];
  }
  const std::int64_t inverse = inverse_root_[squared >> kRootShift];
  const std::int64_t distance = squared * inverse >> 30;
  const std::int64_t overlap = std::max<std::int64_t>(0, ((a.radius + b.radius) >> shift_) - distance);
  Vec3i n{0, -(1 << 14), 0};
  for (std::size_t i = 0; squared != 0 && i < 3; ++i) n[i] = static_cast<std::int32_t>(d[i] * inverse >> 16);
  const Force f = penalty(constants_.pair, overlap << (shift_ + 6), n, u);
  for (std::size_t i = 0; i < 3; ++i) {
    force_[a.slot][i] += f[i];
    force_[b.slot][i] -= f[i];
  }
}

void Contact::add_pairs_of(std::uint32_t place, std::uint32_t cell_end,
                           std::span<const std::array<std::uint32_t, 2>> runs) {
  const Record& self = sorted_[place];
  std::uint32_t count = 0;
  const auto collect = [&](std::uint32_t from, std::uint32_t to) {
    for (std::uint32_t j = from; j < to; ++j) {
      const Record& other = sorted_[j];
      // Wraps for bodies far apart that share a cell of the torus; the first test leaves them out.
      std::uint32_t squared = 0;
      std::uint32_t far = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t d =
            static_cast<std::uint32_t>(other.q[i]) - static_cast<std::uint32_t>(self.q[i]);
        far |= (d + (1U << kReachBits)) >> (kReachBits + 1);
        squared += d * d;
      }
      const std::uint32_t reach = static_cast<std::uint32_t>(self.radius + other.radius) >> shift_;
      partners_[count] = j;
      count += static_cast<std::uint32_t>(far == 0) & static_cast<std::uint32_t>(squared < reach * reach);
    }
  };
  collect(place + 1, cell_end);
  for (const auto& run : runs) collect(run[0], run[1]);
  for (std::uint32_t k = 0; k < count; ++k) add_pair(place, partners_[k]);
}

void Contact::add_pairs() {
  const std::uint32_t mask = (1U << side_bits_) - 1;
  const auto cells = static_cast<std::uint32_t>(begin_.size() - 1);
  std::array<std::array<std::uint32_t, 2>, 13> runs{};
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    if (begin_[cell] == end_[cell]) continue;
    const std::uint32_t x = cell & mask;
    const std::uint32_t y = (cell >> side_bits_) & mask;
    const std::uint32_t z = cell >> (2 * side_bits_);
    std::size_t count = 0;
    const auto look_at = [&](std::uint32_t other_x, std::uint32_t row) {
      const std::uint32_t other = row | (other_x & mask);
      runs[count] = {begin_[other], end_[other]};
      count += static_cast<std::size_t>(begin_[other] != end_[other]);
    };
    look_at(x + 1, cell & ~mask);
    for (const auto& ahead : kRowsAhead) {
      const std::uint32_t row = (((z + static_cast<std::uint32_t>(ahead[1])) & mask) << (2 * side_bits_)) |
                                (((y + static_cast<std::uint32_t>(ahead[0])) & mask) << side_bits_);
      look_at(x - 1, row);
      look_at(x, row);
      look_at(x + 1, row);
    }
    for (std::uint32_t place = begin_[cell]; place < end_[cell]; ++place)
      add_pairs_of(place, end_[cell], std::span(runs).first(count));
  }
}

void Contact::sum_forces(const State& state) {
  add_walls(state);
  sort_into_grid(state);
  add_pairs();
}

void Contact::integrate(State& state, const Drive& drive, bool first) const {
  for (Slot s = 0; s < state.capacity(); ++s) {
    if (state.alive()[s] == 0) continue;
    const std::int64_t mobility = type_of(state, s).mobility;
    for (std::size_t i = 0; i < 3; ++i) {
      std::int32_t& p = state.p(i)[s];
      std::int32_t& v = state.v(i)[s];
      std::int32_t& c = state.c(i)[s];
      const std::int64_t push = share_of(limited(force_[s][i], kVelocityLimit), mobility);
      std::int64_t speed = v + push;
      if (first) {
        speed += std::int64_t{drive.gravity[i]} + c;
        c = limited(c - share_of(c, drive.decay), kVelocityLimit);
        speed -= share_of(speed, drive.damping);
      }
      v = limited(speed, kVelocityLimit);
      p = limited(p + ((v * move_ + (1 << 21)) >> 22), kPositionLimit);
    }
  }
}

void Contact::step(const State& from, State& to, const Drive& drive) {
  if (&from != &to) to = from;
  for (std::int32_t i = 0; i < constants_.substeps; ++i) {
    sum_forces(to);
    integrate(to, drive, i == 0);
  }
}

void Contact::step_slots(const State& from, State& to, const Drive& drive, std::span<const Slot> /*slots*/) {
  step(from, to, drive);
}

}  // namespace tandem
