#include "sdk/core/layout/data_fields.hpp"

#include <algorithm>

namespace tandem {
namespace {

tl::unexpected<Error> refuse(std::string reason) {
  return fail(ErrorCode::kInvalidArgument, std::move(reason));
}

bool is_field_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxDataNameBytes &&
         std::all_of(name.begin(), name.end(),
                     [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; });
}

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(' ');
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

}  // namespace

std::optional<DataKind> data_kind(std::string_view name) {
  const auto* const at = std::find(kDataKinds.begin(), kDataKinds.end(), name);
  if (at == kDataKinds.end()) return std::nullopt;
  return static_cast<DataKind>(at - kDataKinds.begin());
}

std::size_t bytes_of(DataKind kind) {
  constexpr std::array<std::uint8_t, kDataKinds.size()> kBytes{1, 1, 2, 2, 4, 4, 4, 4};
  return kBytes.at(static_cast<std::size_t>(kind));
}

Result<std::vector<DataField>> parse_data_fields(std::string_view text) {
  std::vector<DataField> fields;
  for (std::string_view rest = text; !trimmed(rest).empty();) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const std::string_view field = trimmed(rest.substr(0, comma));
    const std::size_t space = std::min(field.find(' '), field.size());
    const auto kind = data_kind(field.substr(0, space));
    if (!kind) return refuse("data '" + std::string(field) + "': a kind and a name, as in 'u8 health'");
    fields.push_back({static_cast<std::uint32_t>(*kind), std::string(trimmed(field.substr(space)))});
    rest = rest.substr(std::min(comma + 1, rest.size()));
  }
  if (auto good = check_data_fields(fields); !good) return tl::unexpected<Error>(good.error());
  return fields;
}

Result<void> check_data_fields(std::span<const DataField> fields) {
  if (fields.size() > kMaxDataFields) return refuse("data of more than 16 fields");
  for (const DataField& field : fields) {
    if (!is_field_name(field.name))
      return refuse("a field of data has 1 to 32 characters of a-z, 0-9 and '_'");
    if (field.kind >= kDataKinds.size()) return refuse("data field '" + field.name + "' of an unknown kind");
    if (std::count_if(fields.begin(), fields.end(),
                      [&](const DataField& o) { return o.name == field.name; }) > 1)
      return refuse("data field '" + field.name + "' is there twice");
  }
  if (data_record_bytes(fields) > kMaxDataBytes) return refuse("data of more than 16 bytes a body");
  return {};
}

std::size_t data_record_bytes(std::span<const DataField> fields) {
  std::size_t bytes = 0;
  for (const DataField& field : fields) bytes += bytes_of(static_cast<DataKind>(field.kind));
  return bytes;
}

}  // namespace tandem
