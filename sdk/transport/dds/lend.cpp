#include "sdk/transport/dds/lend.hpp"

#include <cstring>

namespace tandem::transport::dds {

Lender::~Lender() = default;  // here, as it is larger than a message's fields

void Lender::put(const void* primitive, std::size_t size) noexcept {
  const std::size_t padding = (0 - reinterpret_cast<std::uintptr_t>(rest_.data())) % size;
  TANDEM_ASSERT(padding + size <= rest_.size());
  std::memcpy(rest_.data() + padding, primitive, size);
  rest_ = rest_.subspan(padding + size);
}

// The members of every sequence. The generated ones have no const, although dds_write() only reads.
void Lender::lend(const void* elements, std::size_t count) noexcept {
  static_assert(offsetof(dds_sequence_t, _buffer) == 8 &&
                offsetof(dds_sequence_t, _release) == 8 + sizeof(void*));
  const auto length = static_cast<std::uint32_t>(count);
  primitive(length);  // maximum
  primitive(length);
  primitive(elements);
  primitive(false);  // release
}

}  // namespace tandem::transport::dds
