#pragma once
// How the fields of a body's data are taken as numbers: idl/PROTOCOL.md, "Data of bodies".

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/layout/data_fields.hpp"

namespace tandem {

/// A part of a record that is coded as one number.
struct DataNumber {
  std::uint8_t at = 0;     ///< its first byte in the record
  std::uint8_t bytes = 1;  ///< 1, 2 or 4, little-endian
  bool is_float = false;   ///< coded so that values in order have numbers in order

  [[nodiscard]] std::uint32_t value_in(const std::byte* record) const;
  void put(std::uint32_t value, std::byte* record) const;
  /// `to` - `from` modulo 2^bits, in -2^(bits - 1) .. 2^(bits - 1) - 1.
  [[nodiscard]] std::int64_t step(std::uint32_t from, std::uint32_t to) const;
  /// False: step() never returns that.
  [[nodiscard]] bool is_step(std::int64_t step) const;
  /// The value after such a step.
  [[nodiscard]] std::uint32_t stepped(std::uint32_t from, std::int64_t step) const;
};

/// Fields that check_data_fields() accepted, at least one.
class DataShape {
 public:
  explicit DataShape(std::span<const DataField> fields);
  [[nodiscard]] std::size_t record_bytes() const { return record_bytes_; }
  [[nodiscard]] std::size_t fields() const { return first_.size() - 1; }
  [[nodiscard]] std::span<const DataNumber> numbers() const { return numbers_; }
  /// The numbers of a field are first_of(field) .. first_of(field + 1) - 1.
  [[nodiscard]] std::size_t first_of(std::size_t field) const { return first_[field]; }

 private:
  std::size_t record_bytes_;
  std::vector<DataNumber> numbers_;
  std::vector<std::size_t> first_;
};

}  // namespace tandem
