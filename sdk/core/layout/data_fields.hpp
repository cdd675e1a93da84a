#pragma once
// The fields of the data that each body has beside its motion: idl/PROTOCOL.md, "Data of bodies".

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"

namespace tandem {

/// The name of the group in a layout, always the last one.
inline constexpr const char* kDataGroup = "data";

inline constexpr std::size_t kMaxDataFields = 16;
inline constexpr std::size_t kMaxDataBytes = 16;  ///< of all fields of a body together
inline constexpr std::size_t kMaxDataNameBytes = 32;

enum class DataKind : std::uint32_t {
  kU8 = 0,
  kI8 = 1,
  kU16 = 2,
  kI16 = 3,
  kU32 = 4,
  kI32 = 5,
  kF32 = 6,
  kRgba = 7,  ///< four bytes: red, green, blue, opacity
};
inline constexpr std::array<std::string_view, 8> kDataKinds{"u8",  "i8",  "u16", "i16",
                                                            "u32", "i32", "f32", "rgba"};

/// One field. `kind`: a DataKind, once check_data_fields() accepted it.
struct DataField {
  std::uint32_t kind = 0;
  std::string name;  ///< 1 .. 32 of a-z, 0-9 and '_'
  bool operator==(const DataField&) const = default;
};

/// Empty if there is no such kind.
[[nodiscard]] std::optional<DataKind> data_kind(std::string_view name);
/// Size of a value. `kind` must be known.
[[nodiscard]] std::size_t bytes_of(DataKind kind);
/// Reads "u8 health, f32 heat, rgba colour". Errors: kInvalidArgument, which names the field.
[[nodiscard]] Result<std::vector<DataField>> parse_data_fields(std::string_view text);
/// Checks kinds, names, their number and size. Errors: kInvalidArgument.
[[nodiscard]] Result<void> check_data_fields(std::span<const DataField> fields);
/// Size of a record, the fields of a body in their order without gaps, little-endian. 0: no fields.
[[nodiscard]] std::size_t data_record_bytes(std::span<const DataField> fields);

}  // namespace tandem
