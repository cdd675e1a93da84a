// Any snapshot: refused, or loaded into a state that holds what every state holds and can be simulated.

#include <cstdlib>
#include <string_view>

#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/core/timeline/snapshot.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kCapacity = 24;

void require(bool holds) {
  if (!holds) std::abort();
}

void try_snapshot(std::span<const std::byte> input, std::string_view name, const Groups& groups) {
  static const std::unique_ptr<Predictor> predictor = std::move(*make_predictor("ballistic", kCapacity, {}));
  // The hash is the caller's to check, so the reader alone must keep every rule.
  const std::unique_ptr<Codec> codec = synthetic::codec_of(name, kCapacity, {}, groups);
  State state(kCapacity, groups);
  const auto snapshot = read_snapshot(input, synthetic::kTypes, state, *codec);
  if (!snapshot) return;
  require(synthetic::broken_invariant(state) == nullptr);
  require(valid_parameters(snapshot->parameters.codec));
  require(snapshot->pending.size() <= kMaxPendingInputs);
  predictor->step(state, state, {snapshot->drive, snapshot->parameters.step});
  require(synthetic::broken_invariant(state) == nullptr);

  // A snapshot that was read can be written and read again.
  std::vector<std::byte> bytes(snapshot_bytes_bound(state, *codec));
  ByteWriter out(bytes);
  write_snapshot(*snapshot, state, *codec, out);
  require(!out.overflow());
  State again(kCapacity, groups);
  require(read_snapshot(out.written(), synthetic::kTypes, again, *codec).has_value());
  require(again == state);
}

}  // namespace
}  // namespace tandem

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tandem::try_snapshot(std::as_bytes(std::span(data, size)), "quantized", {});
  tandem::try_snapshot(std::as_bytes(std::span(data, size)), "tracker", tandem::synthetic::kTurning);
  return 0;
}
