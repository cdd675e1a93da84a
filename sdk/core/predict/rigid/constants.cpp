#include "sdk/core/predict/rigid/constants.hpp"

#include <bit>

namespace tandem {
namespace {

constexpr std::size_t kTypesAt = 7;  // where the number of types is
constexpr std::size_t kSolidValues = 4;
constexpr std::int32_t kMaxSubsteps = 8;

bool is_size(std::int32_t value) { return 1 <= value && value <= Solid::kMaxSize; }

bool is_solid(std::span<const std::int32_t> values) {
  const auto [kind, x, y, z] = std::array{values[0], values[1], values[2], values[3]};
  if (kind == static_cast<std::int32_t>(Solid::Kind::kBox)) return is_size(x) && is_size(y) && is_size(z);
  return kind == static_cast<std::int32_t>(Solid::Kind::kRound) && is_size(x) && (y == 0 || is_size(y)) &&
         z == 0;
}

}  // namespace

std::vector<std::int32_t> write_rigid_constants(const RigidConstants& constants) {
  std::vector<std::int32_t> out = write_contact_constants(constants.contact);
  for (const Solid& solid : constants.solids) {
    out.push_back(static_cast<std::int32_t>(solid.kind));
    out.insert(out.end(), solid.size.begin(), solid.size.end());
  }
  return out;
}

Result<RigidConstants> read_rigid_constants(std::span<const std::int32_t> values) {
  const auto wrong = [] { return fail(ErrorCode::kMalformed, "predictor: solids of wrong number or range"); };
  if (values.size() <= kTypesAt || values[kTypesAt] < 1) return wrong();
  const std::size_t solids = kSolidValues * static_cast<std::size_t>(values[kTypesAt]);
  if (values.size() < solids) return wrong();
  auto contact = read_contact_constants(values.first(values.size() - solids));
  if (!contact) return tl::unexpected(contact.error());
  const auto substeps = static_cast<std::uint32_t>(contact->substeps);
  if (contact->substeps > kMaxSubsteps || !std::has_single_bit(substeps)) return wrong();
  RigidConstants constants{std::move(*contact), {}};
  for (std::size_t at = values.size() - solids; at < values.size(); at += kSolidValues) {
    if (!is_solid(values.subspan(at, kSolidValues))) return wrong();
    constants.solids.push_back(
        {static_cast<Solid::Kind>(values[at]), {values[at + 1], values[at + 2], values[at + 3]}});
  }
  return constants;
}

}  // namespace tandem
