#pragma once
// Which streams are worth making.

#include <array>
#include <cstdint>
#include <optional>

#include "sdk/transport/units.hpp"
#include "services/host/clients/roster.hpp"
#include "services/host/frames/frame_source.hpp"

namespace tandem::host {

/// A stream is made while somebody plays it or was served its snapshot, and for a while after, so that a
/// client which loses its way for a moment costs no new start. Not thread-safe.
class Audience {
 public:
  static constexpr std::int64_t kLingerNs = 5 * kSecond;

  /// The streams to make now; with nobody there the first alone.
  [[nodiscard]] StreamSet wanted(Roster& roster, std::int64_t now_ns);

 private:
  std::array<std::optional<std::int64_t>, transport::kMaxStreams> needed_ns_{};  // last
};

}  // namespace tandem::host
