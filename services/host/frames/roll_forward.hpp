#pragma once
// A world that is made again from a checkpoint and a journal.

#include <span>
#include <string>

#include "sdk/wire/standby_messages.hpp"
#include "services/host/frames/configuration.hpp"

namespace tandem::host {

/// Steps `simulation`, which holds the state of `from`, on to the last frame that `journal` says was made,
/// with the inputs that it has. `journal`: entries without a gap, from the one after from.journal on. Entries
/// behind the last made frame wait in the result as pending inputs. Returns the checkpoint of that frame, but
/// engine_state stays that of `from`; the simulation holds the new one. Errors, after which the simulation
/// has to be loaded again: kMismatch (it makes other frames than the server that wrote the journal),
/// kMalformed (the journal leaves out a frame, has scheduled inputs out of order, or an input that the
/// simulation refuses), kInvalidArgument (`config` does not fit the simulation), kIo (the simulation failed).
[[nodiscard]] Result<checkpoint::Checkpoint> roll_forward(const HostConfig& config,
                                                          engine::Simulation& simulation,
                                                          checkpoint::Checkpoint from,
                                                          std::span<const transport::JournalMessage> journal);

/// A world to go on with.
struct Continued {
  checkpoint::Checkpoint world;  ///< the simulation holds its state
  std::string why_not;           ///< why the journal could not be followed; empty: it was
};
/// Loads `from` into `simulation`, and rolls it forward if that works on this machine. Errors: kMismatch (the
/// simulation does not load it).
[[nodiscard]] Result<Continued> continue_world(const HostConfig& config, engine::Simulation& simulation,
                                               const checkpoint::Checkpoint& from,
                                               std::span<const transport::JournalMessage> journal);

}  // namespace tandem::host
