// Any bytes as a message of any topic: refused, or one that is written and read the same again.

#include "sdk/wire/cdr.hpp"
#include "tests/fuzz/program.hpp"

namespace tandem::transport {
namespace {

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
