#pragma once
// From a world and wishes to a host's configuration: lattice, streams with codec, predictor and tables, and
// what clients are told. A scene, tandem::Server, the benches and the tests all come through here.

#include <vector>

#include "services/host/frames/configuration.hpp"
#include "services/planning/wishes.hpp"
#include "services/planning/world.hpp"
#include "tandem/result.hpp"

namespace tandem::planning {

/// The stream that follows from world and wishes. Where nothing was trained for this size and threshold, the
/// nearest table is used, and the built-in one for a world that was never trained. Errors: kInvalidArgument
/// (the threshold, a world too large for it, or a body type that turns and has no radius), kUnsupported
/// (codec, predictor).
[[nodiscard]] Result<host::StreamConfig> plan_stream(const World& world, const Wishes& wishes);

/// The streams of a session where nobody wished any: where the automatic predictor is not the basic one,
/// `thin` with the basic one and `rich` with that; else none, which means one without a name. Errors: as
/// plan_stream().
[[nodiscard]] Result<std::vector<StreamWishes>> usual_streams(const World& world, const Wishes& wishes);

/// A host's configuration with the streams wished, on the lattice of the finest threshold among them, the
/// world's frame rate, types and names; the rest keeps its defaults. Errors: as plan_stream(), naming the
/// stream where it has a name; also kInvalidArgument for a stream that the lattice cannot hold, for what
/// check_stream() refuses, and as host::check_stream_names().
[[nodiscard]] Result<host::HostConfig> plan_session(const World& world, const Wishes& wishes);

/// The same for a server that begins now: with the usual streams where none are wished, and served as
/// `service` says. Errors: as plan_session().
[[nodiscard]] Result<host::HostConfig> plan_server(const World& world, Wishes wishes,
                                                   const ServiceWishes& service);

}  // namespace tandem::planning
