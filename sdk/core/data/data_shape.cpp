#include "sdk/core/data/data_shape.hpp"

#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kSign = 0x80000000U;

}  // namespace

std::uint32_t DataNumber::value_in(const std::byte* record) const {
  std::uint32_t value = 0;
  for (unsigned i = 0; i < bytes; ++i) value |= std::to_integer<std::uint32_t>(record[at + i]) << (8U * i);
  if (!is_float) return value;
  return (value & kSign) == 0 ? value ^ kSign : ~value;
}

void DataNumber::put(std::uint32_t value, std::byte* record) const {
  if (is_float) value = (value & kSign) != 0 ? value ^ kSign : ~value;
  for (unsigned i = 0; i < bytes; ++i) record[at + i] = static_cast<std::byte>(value >> (8U * i));
}

std::int64_t DataNumber::step(std::uint32_t from, std::uint32_t to) const {
  const unsigned unused = 32 - 8U * bytes;
  return static_cast<std::int32_t>((to - from) << unused) >> unused;
}

bool DataNumber::is_step(std::int64_t step) const {
  const std::int64_t half = std::int64_t{1} << (8U * bytes - 1);
  return step >= -half && step < half;
}

std::uint32_t DataNumber::stepped(std::uint32_t from, std::int64_t step) const {
  const std::uint32_t value = from + static_cast<std::uint32_t>(step);
  return bytes == 4 ? value : value & ((1U << (8U * bytes)) - 1);
}

DataShape::DataShape(std::span<const DataField> fields) : record_bytes_(data_record_bytes(fields)) {
  TANDEM_ASSERT(check_data_fields(fields) && !fields.empty());
  std::uint8_t at = 0;
  for (const DataField& field : fields) {
    first_.push_back(numbers_.size());
    const auto kind = static_cast<DataKind>(field.kind);
    const bool is_colour = kind == DataKind::kRgba;
    const auto bytes = static_cast<std::uint8_t>(is_colour ? 1 : bytes_of(kind));
    for (int i = 0; i < (is_colour ? 4 : 1); ++i) {
      numbers_.push_back({at, bytes, kind == DataKind::kF32});
      at = static_cast<std::uint8_t>(at + bytes);
    }
  }
  first_.push_back(numbers_.size());
}

}  // namespace tandem
