#pragma once
// Assembles deltas from their parts: a bounded queue of complete deltas without a gap.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/wire/messages.hpp"

namespace tandem::client {

struct CompleteDelta {
  Frame frame = 0;
  std::uint64_t last_input = 0;
  std::int64_t server_time_ns =
      0;  ///< when it was made; of all but the last of a message by the nominal rate
  std::uint64_t hash = 0;
  transport::Bytes payload;
  std::uint32_t more = 0;  ///< frames behind this one that the same message tells
};
/// The delta as one message, for a caller that passes it on.
[[nodiscard]] transport::DeltaMessage to_message(const CompleteDelta& delta, Epoch epoch,
                                                 const StreamId& stream);

/// The samples of one writer keep their order, so parts arrive as 0, 1, ... n - 1 and frames one after
/// another; a message that tells several frames counts as all of them. Any other order means that something
/// was lost. Holds one run of frames without a gap. Not thread-safe.
class DeltaAssembly {
 public:
  struct Limits {
    std::uint32_t earlier = 0;             ///< maximum frames that a message tells beside its own
    std::int64_t period_ns = 0;            ///< nominal time between two frames
    std::size_t delta_bytes = 0;           ///< maximum size of a whole payload, as the session declares
    std::size_t frames = 1U << 14U;        ///< maximum number of complete deltas held
    std::size_t total_bytes = 64U << 20U;  ///< maximum payload held; at least four deltas are always allowed
  };
  enum class Outcome : std::uint8_t {
    kStored,    ///< the part was taken; front() may be ready
    kIgnored,   ///< the frame was complete before, or this reader never saw its start
    kLostPart,  ///< a new frame began while one was incomplete, or a part was skipped: the run restarts here
    kGap,       ///< a frame was skipped: the run restarts here
    kRefused,   ///< the part breaks a rule of the format or a limit; everything is dropped
    kOverflow,  ///< the queue is full; everything is dropped
  };

  explicit DeltaAssembly(const Limits& limits) : limits_(limits) {}

  /// Takes one sample of the session's epoch. Untrusted.
  Outcome add(transport::DeltaMessage&& part);
  /// The oldest complete delta, or null.
  [[nodiscard]] const CompleteDelta* front() const { return size() == 0 ? nullptr : &queue_[first_]; }
  void pop();
  /// Drops deltas up to and including `frame`. The one after it is no gap, whichever came last.
  void drop_through(Frame frame);
  /// Forgets everything, including the expected frame.
  void clear();

  [[nodiscard]] std::size_t size() const { return queue_.size() - first_; }
  [[nodiscard]] std::size_t high_water() const { return high_water_; }

 private:
  Outcome start_again(transport::DeltaMessage&& part, Outcome why);
  Outcome begin(transport::DeltaMessage&& part);
  Outcome append(transport::DeltaMessage&& part);
  Outcome finish();
  Outcome take_several(const transport::DeltaMessage& message);
  [[nodiscard]] bool has_room(std::size_t frames, std::size_t bytes) const;

  Limits limits_;
  std::vector<CompleteDelta> queue_;  // begins at first_; the elements before were popped
  std::size_t first_ = 0;
  std::size_t queued_bytes_ = 0;
  std::size_t high_water_ = 0;
  std::optional<Frame> last_complete_;
  // The frame that is being assembled; parts_ is 0 if there is none.
  CompleteDelta open_;
  std::uint32_t parts_ = 0;
  std::uint32_t next_part_ = 0;
};

}  // namespace tandem::client
