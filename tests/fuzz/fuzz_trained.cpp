// Any text as a file of trained tables: refused naming the file, or tables within their ranges.

#include <cmath>

#include "services/engines/scenes/trained.hpp"
#include "tests/fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tandem::fuzz::ScratchFolder folder;
  static_cast<void>(folder.put("any.trained.textproto", {data, size}));
  const auto tables = tandem::scenes::load_trained(folder.put("any.textproto", {}));
  if (!tables) {
    if (tables.error().message.find("any.trained.textproto") == std::string::npos) std::abort();
    return 0;
  }
  for (const auto& table : *tables) {
    if (!std::isfinite(table.position_range_m) || !std::isfinite(table.velocity_range_m_per_s)) std::abort();
  }
  return 0;
}
