#include "sdk/core/predict/contact/pairs.hpp"

#include <cstring>

#include "sdk/core/predict/contact/cells.hpp"
#include "sdk/core/predict/contact/law.hpp"

namespace tandem {
namespace {

// Four bodies at once, in what compilers make of it on any processor.
using Four = std::uint32_t __attribute__((vector_size(16)));
using FourSigned = std::int32_t __attribute__((vector_size(16)));
using Eight = std::uint16_t __attribute__((vector_size(16)));

inline Four load(const std::uint32_t* from) {
  Four x;
  std::memcpy(&x, from, sizeof x);
  return x;
}
inline Four same(std::uint32_t x) { return Four{x, x, x, x}; }

// The squares of the lower and of the upper 16 bits, both signed.
inline Four squared_low(Four words) {
  const FourSigned low = reinterpret_cast<FourSigned>(words << 16U) >> 16;
  return reinterpret_cast<Four>(low * low);
}
inline Four squared_high(Four words) {
  const FourSigned high = reinterpret_cast<FourSigned>(words) >> 16;
  return reinterpret_cast<Four>(high * high);
}
inline Four apart(Four a, Four b) {
  return reinterpret_cast<Four>(reinterpret_cast<Eight>(a) - reinterpret_cast<Eight>(b));
}

// Who is near one body.
class Search {
 public:
  Search(const ContactGrid& grid, const ContactPairs& pairs) : grid_(grid), pairs_(pairs) {}

  [[nodiscard]] std::uint32_t count() const { return pairs_.count; }
  void start(std::uint32_t place) {
    self_ = place;
    self_xy_ = same(grid_.xy[place]);
    self_z_ = same(grid_.z[place]);
    if (grid_.later_xy != nullptr) self_later_xy_ = same(grid_.later_xy[place]);
  }
  void among(std::uint32_t from, std::uint32_t to) {
    for (; from < to; from += 4) {
      const Four xy = apart(load(grid_.xy + from), self_xy_);
      const Four z = apart(load(grid_.z + from), self_z_);
      Four near =
          reinterpret_cast<Four>(squared_low(xy) + squared_high(xy) + squared_low(z) < grid_.near_squared);
      if (grid_.later_xy != nullptr) {
        const Four later = apart(load(grid_.later_xy + from), self_later_xy_);
        near |= reinterpret_cast<Four>(squared_low(later) + squared_high(later) + squared_high(z) <
                                       grid_.near_squared);
      }
      near &= reinterpret_cast<Four>(Four{0, 1, 2, 3} < to - from);
      for (std::uint32_t i = 0; i < 4; ++i) {
        pairs_.first[pairs_.count] = self_;
        pairs_.second[pairs_.count] = from + i;
        pairs_.count += near[i] & 1U;
      }
    }
  }

 private:
  ContactGrid grid_;
  ContactPairs pairs_;
  std::uint32_t self_ = 0;
  Four self_xy_{}, self_z_{}, self_later_xy_{};
};

std::int32_t difference(std::int16_t b, std::int16_t a) { return static_cast<std::int16_t>(b - a); }

void add_forces(const ContactLaw& law, const std::uint32_t* inverse_root, const ContactView* views,
                const ContactPairs& pairs, ContactForce* forces) {
  for (std::uint32_t k = 0; k < pairs.count; ++k) {
    const ContactView& a = views[pairs.first[k]];
    const ContactView& b = views[pairs.second[k]];
    Vec3i d{};
    std::uint32_t squared = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      d[i] = difference(b.q[i], a.q[i]);
      squared += static_cast<std::uint32_t>(d[i] * d[i]);
    }
    const std::int32_t reach = a.radius + b.radius;
    if (squared >= static_cast<std::uint32_t>(reach * reach)) continue;
    const std::uint32_t inverse = inverse_root[squared >> 16];
    // Half way to the middle of the table's entry: its slope is twice the root's.
    const std::uint32_t middle = (squared + ((squared & 0xFFFF0000U) | 0x8000U)) >> 1;
    const auto distance = static_cast<std::int32_t>((middle >> 12) * inverse >> 18);
    Vec3i n{0, squared == 0 ? 1 << 12 : 0, 0};
    Vec3i u{};
    for (std::size_t i = 0; i < 3; ++i) {
      n[i] += d[i] * static_cast<std::int32_t>(inverse) >> 18;
      u[i] = b.v[i] - a.v[i];
    }
    const Vec3i f = contact_force(law, std::max(0, reach - distance), n, u);
    for (std::size_t i = 0; i < 3; ++i) {
      forces[pairs.first[k]].f[i] += f[i];
      forces[pairs.second[k]].f[i] -= f[i];
    }
  }
}

}  // namespace

ContactKernels portable_contact_kernels() { return {find_pairs<Search>, add_forces}; }

ContactKernels fastest_contact_kernels() {
#ifdef TANDEM_CONTACT_AVX2
  if (__builtin_cpu_supports("avx2") != 0) return avx2_contact_kernels();
#endif
  return portable_contact_kernels();
}

}  // namespace tandem
