// Any bytes as a message of any topic: refused, or one that is written and read the same again.

#include <type_traits>
#include <vector>

#include "sdk/wire/cdr.hpp"
#include "sdk/wire/frame_bundle.hpp"
#include "sdk/wire/limits.hpp"
#include "tests/fuzz/program.hpp"

namespace tandem::transport {
namespace {

// What a delta tells, in a bundle of its own, is told the same again.
void check_frames(const DeltaMessage& delta) {
  const std::vector<FrameRun> runs = read_frames(delta);
  if (runs.empty() || delta.earlier > kMaxEarlier) return;
  FrameBundle bundle;
  Frame frame = delta.frame - delta.earlier;
  for (const FrameRun& run : runs) {
    fuzz::require(run.last - run.before == frame && (run.before == 0 || run.payload.empty()));
    for (; frame <= run.last; ++frame) bundle.add(frame, run.hash, run.payload);
  }
  fuzz::require(frame == delta.frame + 1);
  const DeltaMessage again = bundle.take();
  fuzz::require(again.frame == delta.frame && again.earlier == delta.earlier && again.hash == delta.hash);
  std::size_t bytes = 0;
  for (const FrameRun& run : read_frames(again)) bytes += run.payload.size();
  for (const FrameRun& run : runs) bytes -= run.payload.size();
  fuzz::require(bytes == 0);
}

template <class M>
void check(std::span<const std::byte> bytes) {
  const auto message = read_cdr<M>(bytes);
  if (!message) return;
  // Padding may have held anything, and texts compare as bytes do, unlike floats.
  Bytes once;
  write_cdr(*message, once);
  const auto again = read_cdr<M>(once);
  fuzz::require(again.has_value());
  Bytes twice;
  write_cdr(*again, twice);
  fuzz::require(once == twice);
  static_cast<void>(within_limits(*again, Limits{}));
  if constexpr (std::is_same_v<M, DeltaMessage>) check_frames(*again);
}

}  // namespace
}  // namespace tandem::transport

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem::transport;
  if (size == 0) return 0;
  constexpr void (*kChecks[])(std::span<const std::byte>) = {
      check<SessionMessage>,  check<DeltaMessage>,        check<ScheduledInputMessage>,
      check<SnapshotMessage>, check<ReplyMessage>,        check<InputMessage>,
      check<AckMessage>,      check<ServerStatusMessage>, check<ClientStatusMessage>,
      check<JournalMessage>,  check<CheckpointMessage>,   check<StandbyMessage>,
      check<CommandMessage>};
  kChecks[data[0] % std::size(kChecks)](std::as_bytes(std::span(data, size)).subspan(1));
  return 0;
}
