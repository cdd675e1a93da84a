#pragma once
// Collects the frames of a stream into deltas.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/wire/frame_bundle.hpp"
#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::host {

/// Decides for one stream which frames share a delta, and when it leaves (idl/STATES.md, "When deltas
/// leave"). Not thread-safe.
class DeltaCollector {
 public:
  /// A delta is sent after this time, as a sign of life, even if nothing has changed.
  static constexpr std::int64_t kLongestNs = kSecond;
  /// Size of a TandemDelta without its payload, with the header of its encapsulation.
  static constexpr std::size_t kFieldBytes = 60;
  /// A delta of several frames has no larger payload, so that it is one DDS fragment.
  static constexpr std::size_t kMaxBytes = 1344 - kFieldBytes;

  struct Limits {
    std::uint32_t frames = 1;       ///< maximum of a delta
    std::size_t bytes = kMaxBytes;  ///< maximum payload of a delta of several frames
    std::int64_t delay_ns = 0;      ///< maximum time for which a frame waits
    std::int64_t period_ns = 0;     ///< nominal time between two frames
  };
  struct Made {
    Frame frame = 0;
    std::uint64_t hash = 0;
    std::uint64_t last_input = 0;
    std::int64_t wall_ns = 0;  ///< when it was made, as clients are told
    std::span<const std::byte> payload = {};
    bool at_once = false;  ///< it waits for nothing
  };

  explicit DeltaCollector(const Limits& limits) : limits_(limits) {}

  /// Takes a frame that was made, and appends the deltas that leave now. If it does not follow the last one,
  /// nobody was told of that any more.
  void take(const Made& made, std::int64_t now_ns, std::vector<transport::DeltaMessage>& leaving);
  /// Appends a delta that has waited for long enough. `all`: whatever is collected, because no frame follows
  /// soon.
  void release(bool all, std::int64_t now_ns, std::vector<transport::DeltaMessage>& leaving);
  /// What waits. `bytes`: with lengths and hashes.
  struct Held {
    std::uint32_t frames = 0;
    std::size_t bytes = 0;
  };
  [[nodiscard]] Held held() const { return {bundle_.frames(), bundle_.empty() ? 0 : bundle_.bytes_with(0)}; }

 private:
  void leave(std::int64_t now_ns, std::vector<transport::DeltaMessage>& leaving);

  Limits limits_;
  transport::FrameBundle bundle_;
  Made before_;                           // the last frame that was taken, without its payload
  std::optional<std::int64_t> since_ns_;  // since when a frame waits that is not quiet
  std::int64_t told_ns_ = 0;
};

}  // namespace tandem::host
