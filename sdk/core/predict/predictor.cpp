#include "sdk/core/predict/predictor.hpp"

namespace tandem {

void Predictor::step_blocks(const State& from, State& to, const StepInput& input,
                            const StepLedgers& ledgers) {
  step(from, to, input);
  ledgers.to.renew_all(ledgers.number);
}

}  // namespace tandem
