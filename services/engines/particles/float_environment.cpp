#include "services/engines/particles/float_environment.hpp"

namespace tandem::engine {

FloatEnvironment::FloatEnvironment() {
  std::fegetenv(&saved_);
  std::fesetenv(FE_DFL_ENV);
}

FloatEnvironment::~FloatEnvironment() { std::fesetenv(&saved_); }

}  // namespace tandem::engine
