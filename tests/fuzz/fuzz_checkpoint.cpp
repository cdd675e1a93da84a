// Any bytes as the sections of a checkpoint, under a head and checksum that fit: refused, or a checkpoint
// that is written and read the same again. A first byte of 0 leaves head and checksum as they are.

#include <cstring>

#include "sdk/core/lattice/hash.hpp"
#include "services/host/checkpoint/format.hpp"
#include "tests/fuzz/program.hpp"

namespace tandem::checkpoint {
namespace {

void seal(std::vector<std::byte>& file) {
  const std::uint64_t length = file.size() + sizeof(std::uint64_t);
  std::memcpy(&file[16], &length, sizeof length);
  const std::uint64_t sum = hash_bytes(file);
  const auto bytes = std::as_bytes(std::span(&sum, 1));
  file.insert(file.end(), bytes.begin(), bytes.end());
}

void check(std::span<const std::byte> bytes) {
  const auto checkpoint = decode(bytes);
  if (!checkpoint) return;
  std::vector<std::byte> once, twice;
  fuzz::require(encode(*checkpoint, once).has_value());
  const auto again = decode(once);
  fuzz::require(again.has_value());
  fuzz::require(encode(*again, twice).has_value());
  fuzz::require(once == twice);
}

}  // namespace
}  // namespace tandem::checkpoint

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem::checkpoint;
  if (size == 0) return 0;
  const auto bytes = std::as_bytes(std::span(data, size)).subspan(1);
  if (data[0] == 0) {
    check(bytes);
    return 0;
  }
  std::vector<std::byte> file;
  static_cast<void>(encode({}, file));  // the head is what is needed
  file.resize(kHeadBytes);
  file.insert(file.end(), bytes.begin(), bytes.end());
  seal(file);
  check(file);
  return 0;
}
