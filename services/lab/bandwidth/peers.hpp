#pragma once
// Computes what other methods would send for the same frames with the same maximum error: general
// compressors, and dead reckoning as in DIS.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::lab {

/// The properties of a run that all peers need.
struct PeerSetting {
  std::uint32_t bodies = 0;
  double threshold = 0;  ///< scene units: the maximum Euclidean error of a position
  double dt_s = 0;
};

/// Sends positions frame by frame. It sends no velocities and no spawns, which is in its favour.
class Peer {
 public:
  virtual ~Peer() = default;
  /// The bytes for the bodies of the next frame; `seen` (three columns, one value per body) becomes what a
  /// receiver shows. Errors: kUnsupported when a library fails.
  [[nodiscard]] virtual Result<std::size_t> send(const engine::Bodies& bodies,
                                                 std::array<std::vector<double>, 3>& seen) = 0;
};

/// One method; `make` is null if its library was missing at build time.
struct PeerKind {
  std::string_view name;
  std::string_view missing;  ///< the Debian package of the missing library
  std::unique_ptr<Peer> (*make)(const PeerSetting& setting);
};

/// All peers, in the order of their rows.
[[nodiscard]] const std::vector<PeerKind>& peer_kinds();

}  // namespace tandem::lab
