// The kernels in plain C++, one body at a time, and the choice of kernels.
#include "services/engines/particles/kernels.hpp"

#include <bit>
#include <cmath>

#include "services/engines/particles/kernels_any.hpp"

namespace tandem::engine {
namespace {

struct One {
  using F = float;
  using Mask = bool;
  static constexpr std::uint32_t kLanes = 1;
  static F all(float v) { return v; }
  static F load(const float* from) { return *from; }
  static F load_any(const float* from) { return *from; }
  static void store(float* to, F v) { *to = v; }
  static F add(F a, F b) { return a + b; }
  static F sub(F a, F b) { return a - b; }
  static F mul(F a, F b) { return a * b; }
  static F divide(F a, F b) { return a / b; }
  static F root(F a) { return std::sqrt(a); }
  static Mask less(F a, F b) { return a < b; }
  static Mask within(F low, F a, F high) { return a >= low && a <= high; }
  static std::uint32_t bits(Mask m) { return m ? 1 : 0; }
  static F keep(Mask m, F a) { return m ? a : 0; }
  static F choose(Mask m, F a, F b) { return m ? a : b; }
  static F later(const std::uint32_t* a, const std::uint32_t* b) { return *a > *b ? 1.0F : -1.0F; }
  static void count_up(std::uint32_t* to, std::uint32_t from) { *to = from; }
  static void gather_places(const Record* records, const std::uint32_t* places, Lanes<One>& out) {
    const Record& r = records[*places];
    out.x = r.x, out.y = r.y, out.z = r.z, out.radius = r.radius;
  }
  static void gather_motion(const Record* records, const std::uint32_t* places, Lanes<One>& out) {
    const Record& r = records[*places];
    out.vx = r.vx, out.vy = r.vy, out.vz = r.vz;
  }
  static void load_records(const Record* from, Lanes<One>& out) {
    constexpr std::uint32_t kFirst = 0;
    gather_places(from, &kFirst, out);
    gather_motion(from, &kFirst, out);
    out.slot = std::bit_cast<float>(from->slot);
  }
  static void store_records(const Lanes<One>& v, std::uint32_t living, Record* to) {
    if (living != 0) *to = {v.x, v.y, v.z, v.radius, v.vx, v.vy, v.vz, std::bit_cast<std::uint32_t>(v.slot)};
  }
  static std::uint32_t living(F slot) { return std::bit_cast<std::uint32_t>(slot) != kNoSlot ? 1 : 0; }
};

std::uint32_t collect(const Anchors& anchors, std::span<const Run> runs, const Seeker& seeker,
                      std::uint32_t enough, std::uint32_t* out) {
  std::uint32_t count = 0;
  for (const Run& run : runs) {
    for (std::uint32_t i = run.begin; i < run.end && count < enough; ++i) {
      const float dx = anchors.x[i] - seeker.x, dy = anchors.y[i] - seeker.y, dz = anchors.z[i] - seeker.z;
      const float reach = seeker.reach + anchors.radius[i];
      const std::uint32_t place = anchors.place == nullptr ? i : anchors.place[i];
      out[count] = place;
      count += static_cast<std::uint32_t>(dx * dx + dy * dy + dz * dz < reach * reach) &
               static_cast<std::uint32_t>(place != seeker.self);
    }
  }
  return count;
}

std::uint32_t collect_packed(const Vicinity& vicinity, const Seeker& seeker, std::uint32_t enough,
                             std::uint32_t* out) {
  const Run all = vicinity.all();
  return collect(vicinity.anchors(), {&all, 1}, seeker, enough, out);
}

}  // namespace

const Kernels kScalarKernels{&integrate<One>, &judge_speeds<One>, &add_partners<One>, &add_planes<One>,
                             &pack<One>,      &collect,           &collect_packed};

const Kernels& kernels(Instructions instructions) {
#ifdef TANDEM_ENGINE_AVX
  const bool avx2 = __builtin_cpu_supports("avx2") != 0;
  const bool avx512 = avx2 && __builtin_cpu_supports("avx512f") != 0 &&
                      __builtin_cpu_supports("avx512vl") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
                      __builtin_cpu_supports("avx512bw") != 0;
  if (avx512 && (instructions == Instructions::kBest || instructions == Instructions::kAvx512))
    return kAvx512Kernels;
  if (avx2 && instructions != Instructions::kScalar) return kAvx2Kernels;
#endif
  static_cast<void>(instructions);
  return kScalarKernels;
}

}  // namespace tandem::engine
