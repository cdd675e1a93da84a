#pragma once
// The configuration of a host.

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/checkpoint/checkpoint.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/streams/stream.hpp"

namespace tandem::host {

/// The part that does not depend on where frames come from.
struct ServiceConfig {
  std::string session = "default";
  Epoch epoch = 1;  ///< ms of wall clock at the process's start

  double frame_rate_hz = 30;            ///< nominal; decides the period and when a client is blamed
  bool free_rate = false;               ///< as fast as window and queue allow (--rate max)
  std::optional<std::uint32_t> window;  ///< frames; empty: chosen from measured round trips
  std::uint32_t window_ceiling = 24;
  std::optional<std::int64_t> stall_timeout_ns = kSecond / 2;  ///< empty: nobody is demoted
  std::uint32_t wait_for = 0;                                  ///< participants that must play before frame 1
  std::uint32_t client_limit = 256;
  std::uint32_t participant_limit = 16;  ///< maximum for one DDS participant, so that it cannot take all
                                         ///< seats
  std::int64_t claim_ns = kSecond / 2;   ///< how long to look for another server before announcing
  Outbox::Limits outbox;
  /// The server that this one takes over from. It may still be heard for a while and has no claim then.
  std::optional<transport::ParticipantId> takes_over_from;

  /// For measurement only: a monotonic clock in nanoseconds. Without a clock all durations read 0, and deltas
  /// are stamped with the time at which their frame started.
  std::int64_t (*clock_ns)() = nullptr;
};

/// The configuration of a host with a running simulation.
struct HostConfig : ServiceConfig {
  Frame start_frame = 0;
  /// The session's 1 to 8 offers, of streams of the same bodies. They share one lattice and one lead, 0 or 1;
  /// layout.capacity is the simulation's. Several streams need different names; two with one name are offers
  /// of one stream, which is encoded once. Offers that carry another's frames stand behind all that encode.
  /// Clients choose one (sdk/client/session/stream_choice.hpp); a client that does not choose plays the
  /// first.
  std::vector<StreamConfig> streams;
  /// Maximum |coordinate| that is shown to clients, scene units. The lattice's limit is at least that.
  double extent = std::numeric_limits<double>::infinity();

  /// A frame's step begins before the frame before it is encoded, if it would be late otherwise. It gains
  /// time only for a simulation whose begin_step() returns before the step is made.
  bool pipeline = false;

  std::string scene;
  std::string scene_json;
  std::string engine;  ///< name of the simulation's engine, for checkpoints
  transport::UpAxis up_axis = transport::UpAxis::kY;
  Epoch continues_epoch = 0;  ///< the epoch that this one continues; 0: none
  Frame continues_frame = 0;  ///< the frame of that epoch from which this one continues
  /// The checkpoint from which the simulation was loaded; the session continues its world. It decides
  /// start_frame, continues_epoch and continues_frame, and frame 1 is not waited for. Null: a new world.
  std::shared_ptr<const checkpoint::Checkpoint> goes_on_from;
  /// What clients draw for each type; layout.type_count elements.
  std::vector<transport::BodyType> types{{.name = "body", .radius = 0, .colour_rgba = 0xFFFFFFFF}};
};

}  // namespace tandem::host
