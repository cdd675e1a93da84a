// What an engine of IMD sends, and topologies: any bytes in any pieces. Refused with a line, or read.

#include <string_view>

#include "services/adapters/imd/topology.hpp"
#include "services/adapters/imd/wire.hpp"
#include "tests/fuzz/program.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem::imd;
  if (size < 2) return 0;
  const std::span<const std::byte> bytes = std::as_bytes(std::span(data, size)).subspan(2);
  const std::uint32_t atoms = data[0] % 8;
  const std::size_t piece = 1U + data[1];
  EngineReader engine(atoms);
  bool reads = true;
  for (std::size_t at = 0; reads && at < bytes.size(); at += piece) {
    const auto part = bytes.subspan(at, std::min(piece, bytes.size() - at));
    const auto good = engine.take(
        part, [](const Session& session) { tandem::fuzz::require(session.coordinates); },
        [atoms](Frame& frame) {
          tandem::fuzz::require(frame.positions.size() == 3U * atoms);
          tandem::fuzz::require(frame.velocities.empty() || frame.velocities.size() == 3U * atoms);
        });
    reads = good.has_value();
    if (!good) tandem::fuzz::require(!good.error().message.empty());
  }
  const auto topology = parse_topology({reinterpret_cast<const char*>(data), size}, std::nullopt);
  if (topology)
    for (const std::uint16_t kind : topology->kind_of) tandem::fuzz::require(kind < topology->kinds.size());
  return 0;
}
