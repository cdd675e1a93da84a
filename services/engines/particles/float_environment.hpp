#pragma once
// Sets up floating point as the engine needs it.

#include <cfenv>

namespace tandem::engine {

/// Sets the default rounding mode and full denormals for its lifetime: a plug-in linked with fast-math may
/// have changed them for this thread, and with them every result.
class FloatEnvironment {
 public:
  FloatEnvironment();
  FloatEnvironment(const FloatEnvironment&) = delete;
  FloatEnvironment& operator=(const FloatEnvironment&) = delete;
  FloatEnvironment(FloatEnvironment&&) = delete;
  FloatEnvironment& operator=(FloatEnvironment&&) = delete;
  ~FloatEnvironment();

 private:
  std::fenv_t saved_{};
};

}  // namespace tandem::engine
