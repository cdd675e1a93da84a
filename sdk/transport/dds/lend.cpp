#include "sdk/transport/dds/lend.hpp"

#include <cstring>

namespace tandem::transport::dds {

Lender::~Lender() = default;  // here, as it is larger than a message's fields

void Lender::put(const void* member, std::size_t size, std::size_t alignment) noexcept {
  const std::size_t padding = (0 - reinterpret_cast<std::uintptr_t>(rest_.data())) % alignment;
  TANDEM_ASSERT(padding + size <= rest_.size());
  std::memcpy(rest_.data() + padding, member, size);
  rest_ = rest_.subspan(padding + size);
}

// Every generated sequence has these members; they have no const, although dds_write() only reads.
void Lender::lend(const void* elements, std::size_t count) noexcept {
  dds_sequence_t sequence{};
  sequence._maximum = sequence._length = static_cast<std::uint32_t>(count);
  sequence._buffer = static_cast<std::uint8_t*>(const_cast<void*>(elements));
  put(&sequence, sizeof sequence, alignof(dds_sequence_t));
}

}  // namespace tandem::transport::dds
