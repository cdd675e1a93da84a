// The contact law over several bodies side by side, for a type V of lanes; included by the kernels alone.
// Element-wise operations only, so that the number of lanes changes no bit.

#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>

#include "services/engines/particles/kernels.hpp"

namespace tandem::engine {
namespace {

// The compiler makes few wide loads and stores of the copies.
template <class V>
void pack(const Anchors& anchors, std::span<const Run> runs, Vicinity& out) {
  constexpr std::uint32_t kPiece = V::kLanes;
  std::uint32_t count = 0;
  for (const Run& run : runs) {
    const std::uint32_t length = run.end - run.begin;
    for (std::uint32_t i = 0; i < length; i += kPiece) {
      const std::uint32_t from = run.begin + i, to = count + i;
      std::memcpy(&out.x[to], anchors.x + from, kPiece * sizeof(float));
      std::memcpy(&out.y[to], anchors.y + from, kPiece * sizeof(float));
      std::memcpy(&out.z[to], anchors.z + from, kPiece * sizeof(float));
      std::memcpy(&out.radius[to], anchors.radius + from, kPiece * sizeof(float));
      V::count_up(&out.place[to], from);
    }
    count += length;
  }
  out.count = count;
  std::fill_n(&out.radius[count], kGroup, std::numeric_limits<float>::quiet_NaN());
}

// S. Green 2008: -spring * overlap * n + damping * u + shear * (u - (u.n) n), with u written once; added
// where `touching`. A sum that began at +0 is never -0, so adding +0 elsewhere changes nothing.
template <class V>
struct Law {
  explicit Law(const Material& m)
      : spring(V::all(m.spring)), shear(V::all(m.shear)), drag(V::all(m.damping + m.shear)) {}
  void add(typename V::Mask touching, typename V::F overlap, typename V::F nx, typename V::F ny,
           typename V::F nz, typename V::F ux, typename V::F uy, typename V::F uz, typename V::F& fx,
           typename V::F& fy, typename V::F& fz) const {
    const auto along = V::add(V::mul(spring, overlap), V::mul(shear, dot(ux, uy, uz, nx, ny, nz)));
    fx = V::add(fx, V::keep(touching, V::sub(V::mul(drag, ux), V::mul(along, nx))));
    fy = V::add(fy, V::keep(touching, V::sub(V::mul(drag, uy), V::mul(along, ny))));
    fz = V::add(fz, V::keep(touching, V::sub(V::mul(drag, uz), V::mul(along, nz))));
  }
  static typename V::F dot(typename V::F ax, typename V::F ay, typename V::F az, typename V::F bx,
                           typename V::F by, typename V::F bz) {
    return V::add(V::add(V::mul(ax, bx), V::mul(ay, by)), V::mul(az, bz));
  }
  typename V::F spring, shear, drag;
};

template <class V>
struct Lanes {
  typename V::F x, y, z, radius, vx, vy, vz;
  typename V::F slot;  ///< its bits
};

// v = (v + kick + h * force / mass) * keep, p += h * v.
template <class V>
void integrate(Record* records, const Forces& forces, const float* inverse_mass, const Anchors& anchors,
               std::uint32_t first, const Advance& motion, Gone& gone) {
  const auto h = V::all(motion.h), keep = V::all(motion.keep);
  const auto moved = [&](typename V::F& at, typename V::F& v, typename V::F force, typename V::F scale,
                         std::size_t axis) {
    v = V::mul(V::add(V::add(v, V::all(motion.kick[axis])), V::mul(scale, force)), keep);
    at = V::add(at, V::mul(h, v));
    return V::bits(V::within(V::all(motion.low[axis]), at, V::all(motion.high[axis])));
  };
  gone = {};
  for (std::uint32_t lane = 0; lane < kGroup; lane += V::kLanes) {
    const std::uint32_t at = first + lane;
    Lanes<V> self;
    V::load_records(records + at, self);
    const auto scale = V::mul(h, V::load_any(inverse_mass + at));
    std::uint32_t inside = moved(self.x, self.vx, V::load(forces.x + lane), scale, 0);
    inside &= moved(self.y, self.vy, V::load(forces.y + lane), scale, 1);
    inside &= moved(self.z, self.vz, V::load(forces.z + lane), scale, 2);
    const auto dx = V::sub(V::sub(self.x, V::load_any(anchors.x + at)), V::all(motion.drift[0]));
    const auto dy = V::sub(V::sub(self.y, V::load_any(anchors.y + at)), V::all(motion.drift[1]));
    const auto dz = V::sub(V::sub(self.z, V::load_any(anchors.z + at)), V::all(motion.drift[2]));
    const std::uint32_t loose =
        V::bits(V::less(V::all(motion.far_squared), Law<V>::dot(dx, dy, dz, dx, dy, dz)));
    const std::uint32_t living = V::living(self.slot);
    V::store_records(self, living, records + at);
    gone.loose |= (loose & living) << lane;
    gone.outside |= (~inside & living) << lane;
  }
}

template <class V>
void judge_speeds(const Record* records, std::uint32_t first, float slow, float fast, Speeds& out) {
  out = {};
  for (std::uint32_t lane = 0; lane < kGroup; lane += V::kLanes) {
    Lanes<V> self;
    V::load_records(records + first + lane, self);
    const auto squared = Law<V>::dot(self.vx, self.vy, self.vz, self.vx, self.vy, self.vz);
    const std::uint32_t living = V::living(self.slot);
    out.living |= living << lane;
    out.slow |= (V::bits(V::less(squared, V::all(slow))) & living) << lane;
    out.fast |= (V::bits(V::less(V::all(fast), squared)) & living) << lane;
  }
}

template <class V>
void add_partners(const Record* records, std::uint32_t first, const std::uint32_t* entries,
                  std::uint32_t rows, const Material& material, Sums& sums) {
  const Law<V> law(material);
  const auto zero = V::all(0), one = V::all(1);
  for (std::uint32_t lane = 0; lane < kGroup; lane += V::kLanes) {
    std::uint32_t own[V::kLanes];
    for (std::uint32_t i = 0; i < V::kLanes; ++i) own[i] = first + lane + i;
    Lanes<V> self, other;
    V::gather_places(records, own, self);
    V::gather_motion(records, own, self);
    auto fx = V::load(sums.x + lane), fy = V::load(sums.y + lane), fz = V::load(sums.z + lane);
    std::uint32_t touched = 0;
    for (std::uint32_t row = 0; row < rows; ++row) {
      const std::uint32_t* const places = entries + row * kGroup + lane;
      V::gather_places(records, places, other);
      const auto dx = V::sub(other.x, self.x), dy = V::sub(other.y, self.y), dz = V::sub(other.z, self.z);
      const auto squared = Law<V>::dot(dx, dy, dz, dx, dy, dz);
      const auto reach = V::add(self.radius, other.radius);
      const auto touching = V::less(squared, V::mul(reach, reach));
      const std::uint32_t bits = V::bits(touching);
      if (bits == 0) continue;
      touched |= bits;
      V::gather_motion(records, places, other);
      const auto distance = V::root(squared);
      const auto inverse = V::divide(one, distance);
      auto nx = V::mul(inverse, dx), ny = V::mul(inverse, dy), nz = V::mul(inverse, dz);
      const auto apart = V::less(zero, distance);
      if ((bits & ~V::bits(apart)) != 0) {
        // Two bodies at the same point separate along y, the earlier one downwards.
        nx = V::keep(apart, nx);
        ny = V::choose(apart, ny, V::later(places, own));
        nz = V::keep(apart, nz);
      }
      law.add(touching, V::sub(reach, distance), nx, ny, nz, V::sub(other.vx, self.vx),
              V::sub(other.vy, self.vy), V::sub(other.vz, self.vz), fx, fy, fz);
    }
    V::store(sums.x + lane, fx);
    V::store(sums.y + lane, fy);
    V::store(sums.z + lane, fz);
    sums.touching |= touched << lane;
  }
}

template <class V>
void add_planes(const Record* records, std::uint32_t first, std::span<const Plane> planes,
                const Material& material, Sums& sums) {
  const Law<V> law(material);
  const auto minus = V::all(-1);
  for (std::uint32_t lane = 0; lane < kGroup; lane += V::kLanes) {
    Lanes<V> self;
    V::load_records(records + first + lane, self);
    auto fx = V::load(sums.x + lane), fy = V::load(sums.y + lane), fz = V::load(sums.z + lane);
    std::uint32_t touched = 0;
    for (const Plane& plane : planes) {
      const auto nx = V::all(plane.normal[0]), ny = V::all(plane.normal[1]), nz = V::all(plane.normal[2]);
      const auto height = V::sub(Law<V>::dot(nx, ny, nz, self.x, self.y, self.z), V::all(plane.offset));
      const auto overlap = V::sub(self.radius, height);
      const auto touching = V::less(V::all(0), overlap);
      const std::uint32_t bits = V::bits(touching);
      if (bits == 0) continue;
      touched |= bits;
      law.add(touching, overlap, V::mul(minus, nx), V::mul(minus, ny), V::mul(minus, nz),
              V::mul(minus, self.vx), V::mul(minus, self.vy), V::mul(minus, self.vz), fx, fy, fz);
    }
    V::store(sums.x + lane, fx);
    V::store(sums.y + lane, fy);
    V::store(sums.z + lane, fz);
    sums.touching |= touched << lane;
  }
}

}  // namespace
}  // namespace tandem::engine
