#pragma once
// The exponential by which learned parameters change.

namespace tandem::host {

/// exp(x) for |x| <= 1 by its Pade approximant of order [3/3], to 1e-6. std::exp is not used, because its
/// last bit may differ from machine to machine, and what is learned goes on the wire.
inline double exp_of(double x) {
  const double even = 120 + 12 * x * x;
  const double odd = 60 * x + x * x * x;
  return (even + odd) / (even - odd);
}

}  // namespace tandem::host
