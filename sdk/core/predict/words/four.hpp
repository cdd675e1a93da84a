#pragma once
// Four 32-bit integers at once, as vector types that compilers translate for any processor.

#include <cstdint>
#include <cstring>

namespace tandem {

using Four = std::int32_t __attribute__((vector_size(16)));
using FourBits = std::uint32_t __attribute__((vector_size(16)));
using FourWords = std::int16_t __attribute__((vector_size(8)));
using EightWords = std::int16_t __attribute__((vector_size(16)));
using EightHalves = std::uint16_t __attribute__((vector_size(16)));  ///< differences of these wrap

inline Four same(std::int32_t x) { return Four{x, x, x, x}; }
inline FourBits same(std::uint32_t x) { return FourBits{x, x, x, x}; }
inline std::uint32_t bits_of(std::int32_t x) { return static_cast<std::uint32_t>(x); }
inline std::int32_t value_of(std::uint32_t bits) { return static_cast<std::int32_t>(bits); }
inline FourBits bits_of(Four x) { return reinterpret_cast<FourBits>(x); }
inline Four value_of(FourBits bits) { return reinterpret_cast<Four>(bits); }

/// Loads a vector from memory.
template <class Vector, class T>
inline Vector load(const T& from) {
  Vector x;
  std::memcpy(&x, &from, sizeof x);
  return x;
}

/// Works for vectors and single integers.
template <class X>
inline X clamped(X x, X limit) {
  x = x < -limit ? -limit : x;
  return x > limit ? limit : x;
}

}  // namespace tandem
