#pragma once
// The exponential by which learned parameters change.

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {

/// exp(x) for |x| <= 2 by its Pade approximant of order [3/3], to 1e-5 for |x| <= 1 and 2e-3 beyond. std::exp
/// is not used, because its last bit may differ from machine to machine, and what is learned goes on the
/// wire.
inline double exp_of(double x) {
  TANDEM_ASSERT(-2.001 < x && x < 2.001);
  const double even = 120 + 12 * x * x;
  const double odd = 60 * x + x * x * x;
  return (even + odd) / (even - odd);
}

}  // namespace tandem::host
