#pragma once
// What a host is told at its start.

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sdk/transport/messages.hpp"
#include "sdk/transport/units.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/streams/stream.hpp"

namespace tandem::host {

/// What a host decides by itself, whatever its frames come from.
struct ServiceConfig {
  std::string session = "default";
  Epoch epoch = 1;  ///< ms of wall clock at the process's start

  double frame_rate_hz = 30;            ///< nominal; decides the period and what a client is blamed for
  bool free_rate = false;               ///< as fast as window and queue allow (--rate max)
  std::optional<std::uint32_t> window;  ///< frames; empty: automatic from measured round trips
  std::uint32_t window_ceiling = 24;
  std::optional<std::int64_t> stall_timeout_ns = kSecond / 2;  ///< empty: nobody is demoted
  std::uint32_t wait_for = 0;                                  ///< participants that must play before frame 1
  std::uint32_t client_limit = 256;
  std::uint32_t participant_limit = 16;  ///< clients of one DDS participant, or it could take all seats
  std::int64_t claim_ns = kSecond / 2;   ///< how long to look for another server before announcing
  Outbox::Limits outbox;

  /// For measurement only: a monotonic clock in nanoseconds; without one all durations read 0, and deltas are
  /// stamped with the time at which their frame started.
  std::int64_t (*clock_ns)() = nullptr;
};

/// The same with a simulation that runs.
struct HostConfig : ServiceConfig {
  Frame start_frame = 0;
  /// 1 to 8 ways of telling all bodies, of one lattice and one lead, 0 or 1; layout.capacity is the
  /// simulation's. Several have names, each its own. Clients choose (sdk/client/session/stream_choice.hpp);
  /// one that chooses nothing plays the first.
  std::vector<StreamConfig> streams;
  /// Largest |coordinate| that clients are told of, scene units; the lattice's own limit is at least that.
  double extent = std::numeric_limits<double>::infinity();

  std::string scene;
  std::string scene_description;
  /// layout.type_count of them: what clients draw.
  std::vector<transport::BodyType> types{{.name = "body", .radius = 0, .colour_rgba = 0xFFFFFFFF}};
};

}  // namespace tandem::host
