#pragma once
// A simulation whose steps are made on a thread of its own, so that the server works meanwhile.

#include <memory>

#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine {

/// Wraps a simulation that computes in this process. begin_step() returns at once, and step_descriptor()
/// becomes readable when the step is made. All other functions that reach `simulation` wait for that, so
/// `simulation` is never called twice at a time; but step() comes from another thread than the rest. Not
/// thread-safe. Errors: kIo (the system gives no descriptor).
Result<std::unique_ptr<Simulation>> step_in_background(std::unique_ptr<Simulation> simulation);

}  // namespace tandem::engine
