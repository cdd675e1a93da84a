#pragma once
// Turns a world and an operator's wishes into a host's configuration: lattice, streams with codec, predictor
// and tables, and what clients are told. A scene, tandem::Server, the benches and the tests all use these
// functions.

#include <vector>

#include "services/host/frames/configuration.hpp"
#include "services/host/planning/wishes.hpp"
#include "services/host/planning/world.hpp"
#include "tandem/result.hpp"

namespace tandem::planning {

/// The stream that follows from world and wishes. If nothing was trained for this size and threshold, it uses
/// the nearest table; for a world that was never trained, the built-in one. Errors: kInvalidArgument (the
/// threshold, a world too large for it, or a body type that turns and has no radius), kUnsupported (codec,
/// predictor).
[[nodiscard]] Result<host::StreamConfig> plan_stream(const PlannedWorld& world, const Wishes& wishes);

/// The default streams of a session: `thin` with the basic predictor; `rich` with the automatic one if that
/// is another; and those that are worth a trial, by the names of their predictors. If that would be `thin`
/// alone the result is empty, which means one stream without a name. Errors: as plan_stream().
[[nodiscard]] Result<std::vector<StreamWishes>> usual_streams(const PlannedWorld& world,
                                                              const Wishes& wishes);

/// A host's configuration with the wished streams, each in its delays, on the lattice of the minimum
/// threshold among them, and with the world's frame rate, types and names. The rest keeps its defaults.
/// Errors: as plan_stream(), naming the stream if it has a name; also kInvalidArgument for a stream that the
/// lattice cannot hold and for what wishes_of() refuses; and as host::check_stream_names().
[[nodiscard]] Result<host::HostConfig> plan_session(const PlannedWorld& world, const Wishes& wishes);

/// Does the same for a server: uses the default streams if none are wished, and the delays kUsualDelaysS for
/// those without one, or the first of these if that would be too many offers; and serves them as `service`
/// says. Errors: as plan_session().
[[nodiscard]] Result<host::HostConfig> plan_server(const PlannedWorld& world, Wishes wishes,
                                                   const ServiceWishes& service);

}  // namespace tandem::planning
