#pragma once
// What a world is made of, drawn from its seed.

#include <cstdint>
#include <string>
#include <vector>

#include "sdk/transport/simulated/network.hpp"
#include "sdk/wire/messages.hpp"
#include "services/engines/common/world.hpp"
#include "services/host/frames/configuration.hpp"

namespace tandem::world {

/// Times that the rules allow (idl/STATES.md), with the steps in which this world looks.
struct Rules {
  /// Whoever can get in plays: the longest patience between two questions, and a lease.
  static constexpr std::int64_t kPlaysNs = 10'000'000'000;
  /// Who was demoted is a participant again: in time for 10 s, besides.
  static constexpr std::int64_t kReturnsNs = 10'000'000'000;
  /// Everybody else waits for one that does not answer.
  static constexpr std::int64_t kStallNs = 500'000'000;
  /// A server that hands over waits so long for the other one.
  static constexpr std::int64_t kHandoverNs = 3'000'000'000;
  /// What a checkpoint may be old.
  static constexpr std::int64_t kCheckpointNs = 1'000'000'000;
};

struct ClientSettings {
  transport::Role role = transport::Role::kParticipant;
  std::uint32_t lead = 1;
  std::string prefer;
  double inputs_per_s = 1;
  bool draws = false;  ///< an application that shows the bodies
};

struct Settings {
  std::uint64_t seed = 1;
  double seconds = 60;  ///< of which the last kHealingS are without faults
  double frame_rate_hz = 30;
  engine::EngineWorld scene;
  std::vector<std::string> codecs;  ///< one for each stream
  std::uint32_t lead = 1;
  bool narrow_window = false;
  transport::simulated::LinkModel link;
  std::vector<ClientSettings> clients;    ///< that are there from the start
  std::vector<ClientSettings> newcomers;  ///< that may join
  std::vector<std::uint32_t> ranks;       ///< of the servers that stand by
  bool swaps = false;                     ///< a server whose session another one has stands by from then on
  bool records = false;
  bool has_gateway = false;
  std::vector<ClientSettings> viewers;  ///< of the gateway
  bool engine_process = false;          ///< the engine of a server is another process

  static constexpr double kHealingS = 22;
};

/// In a line.
[[nodiscard]] std::string text_of(const Settings& settings);

/// One world in eight is such; nothing else of it is drawn differently.
[[nodiscard]] constexpr bool has_engine_process(std::uint64_t seed) { return seed % 8 == 5; }
/// Of every second of these, steps take up to 1.1 frames for some seconds, so that the host begins them
/// early.
[[nodiscard]] constexpr bool has_slow_engine(std::uint64_t seed) { return seed % 16 == 13; }

[[nodiscard]] Settings draw_settings(std::uint64_t seed, double seconds);

/// How the server is started, but for its epoch.
[[nodiscard]] host::HostConfig host_config(const Settings& settings);

}  // namespace tandem::world
