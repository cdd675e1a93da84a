#include "services/host/streams/gains.hpp"

#include <cmath>

#include "services/host/streams/exponential.hpp"

namespace tandem::host {
namespace {

// The change of the logarithms of beta and E per cosine, and its maximum in one decision. The logarithms are
// never computed: beta and E are multiplied by exp(change).
constexpr double kGainRate = 0.2, kMaxGainChange = 0.3;
constexpr double kDecayRate = 2, kMaxDecayChange = 0.7;
constexpr double kLeastGain = 0.35, kMaxGain = 1.8;
constexpr double kLeastDecay = 15, kMaxDecay = 60000;  // in 1/65536
// If less of c is kept, less is worth learning: gamma = 0.25 if E is below 800, then it falls as its inverse.
constexpr double kMaxAcceleration = 0.25, kDecayOfMost = 800;
// beta needs three times as many corrections, because bodies that start to fall agree with themselves for a
// while.
constexpr double kMoreForGain = 3;
// Smaller relative changes are not worth the bytes of sending them.
constexpr double kGainDeadBand = 0.1, kDecayDeadBand = 0.3;

double mean(std::int64_t cosines, std::uint64_t count) {
  return static_cast<double>(cosines) /
         (static_cast<double>(GainEvidence::kCosineOne) * static_cast<double>(count));
}

bool differs(double wanted, double held, double band) { return std::abs(wanted - held) > band * held; }

}  // namespace

GainGoal usual_gain_goal(const PredictorTraits& predictor) {
  return {predictor.gain_aim.agreement / 100.0, predictor.gain_aim.forwardness / 100.0};
}

void set_first_gains(const PredictorTraits& predictor, StreamParameters& parameters) {
  const FirstGains& first = predictor.first_gains;
  parameters.step.decay = first.decay;
  parameters.codec.velocity_gain = first.beta;
  parameters.codec.acceleration_gain = first.gamma;
}

GainControl::GainControl(const GainGoal& goal, std::uint32_t bodies, const StreamParameters& parameters)
    : goal_(goal),
      enough_(enough_corrections(bodies)),
      decay_(std::clamp<double>(parameters.step.decay, kLeastDecay, kMaxDecay)),
      gain_(std::clamp(parameters.codec.velocity_gain / 32768.0, kLeastGain, kMaxGain)) {}

bool GainControl::after_frame(StreamParameters& parameters) {
  if (++frames_ < kFramesPerDecision) return false;
  const GainEvidence seen = evidence_;
  evidence_ = {};
  frames_ = 0;
  const auto belief = [](std::uint64_t count, double enough) {
    return std::min(1.0, static_cast<double>(count) / enough);
  };
  if (seen.repeated > 0) {
    const double off = mean(seen.agreement, seen.repeated) - goal_.agreement;
    const double change = kGainRate * off * belief(seen.repeated, kMoreForGain * enough_);
    gain_ =
        std::clamp(gain_ * exp_of(std::clamp(change, -kMaxGainChange, kMaxGainChange)), kLeastGain, kMaxGain);
  }
  if (seen.driven > 0) {
    const double off = goal_.forwardness - mean(seen.forwardness, seen.driven);
    const double change = kDecayRate * off * belief(seen.driven, enough_);
    decay_ = std::clamp(decay_ * exp_of(std::clamp(change, -kMaxDecayChange, kMaxDecayChange)), kLeastDecay,
                        kMaxDecay);
  }
  const double gain = 32768 * gain_;
  if (!differs(decay_, parameters.step.decay, kDecayDeadBand) &&
      !differs(gain, parameters.codec.velocity_gain, kGainDeadBand))
    return false;
  parameters.step.decay = static_cast<std::uint16_t>(decay_);
  parameters.codec.velocity_gain = static_cast<std::uint16_t>(gain);
  parameters.codec.acceleration_gain =
      static_cast<std::uint16_t>(65536 * kMaxAcceleration * std::min(1.0, kDecayOfMost / decay_));
  return true;
}

}  // namespace tandem::host
