#pragma once
// How a session goes on from a checkpoint.

#include "services/host/checkpoint/keeper.hpp"
#include "services/host/frames/configuration.hpp"

namespace tandem::host {

/// What the checkpoints of a session are of.
[[nodiscard]] checkpoint::CheckpointWorld checkpoint_world(const HostConfig& config);

/// Has the session begin as `start` says. Its epoch is above that of every checkpoint.
void begin_from(const checkpoint::Start& start, HostConfig& config);

/// The same for a server that stood by and takes over from the server `from`: it announces itself at once.
/// `config`'s epoch is Standby::epoch_at().
void begin_takeover(checkpoint::Start start, const transport::ParticipantId& from, HostConfig& config);

}  // namespace tandem::host
