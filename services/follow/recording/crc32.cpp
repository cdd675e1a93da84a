#include <zlib.h>

#include "services/follow/recording/mcap_format.hpp"

namespace tandem::recording {

std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t before) {
  if (bytes.empty()) return before;  // to zlib, no address means to begin anew
  return static_cast<std::uint32_t>(
      ::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace tandem::recording
