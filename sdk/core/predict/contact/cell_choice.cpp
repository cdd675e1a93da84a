#include "sdk/core/predict/contact/cell_choice.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kPlaceBits = 21;                // of a place in the search: 16 bits of 2^5 grid units
constexpr std::int64_t kReach = std::int64_t{1} << 15;  // grid units; bodies that touch are nearer
constexpr std::uint32_t kLeastBits = 2;
constexpr std::int64_t kMaxRepeats = 8;

std::int64_t cell_of(std::int64_t grid_units, std::int32_t cells_per) {
  return (grid_units * cells_per) >> 32;
}

}  // namespace

void CellExtent::add(const CellExtent& other) {
  for (std::size_t i = 0; i < 3; ++i) {
    low[i] = std::min(low[i], other.low[i]);
    high[i] = std::max(high[i], other.high[i]);
  }
}

CellChoice::CellChoice(std::uint32_t side_bits) : protocol_{side_bits, 2 * side_bits, 3 * side_bits} {}

ContactCellBits CellChoice::choose(const CellExtent& extent, std::uint32_t shift, std::int32_t cells_per) {
  if (refused_ > 0) {
    --refused_;
    return protocol_;
  }
  std::array<std::int64_t, 3> cells{};
  Repeats repeats{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t units =
        (std::int64_t{extent.high[i]} >> shift) - (std::int64_t{extent.low[i]} >> shift);
    cells[i] = cell_of(units, cells_per) + 2;
    repeats[i] = (units + kReach) >> kPlaceBits;
  }
  ContactCellBits best = protocol_;
  const std::int64_t usual = times_covered(cells, protocol_);
  std::int64_t least = usual;
  for (std::uint32_t x = kLeastBits; x + 2 * kLeastBits <= protocol_.all; ++x) {
    for (std::uint32_t y = kLeastBits; x + y + kLeastBits <= protocol_.all; ++y) {
      const ContactCellBits bits{x, x + y, protocol_.all};
      if (const std::int64_t count = times_covered(cells, bits); count < least) {
        least = count;
        best = bits;
      }
    }
  }
  // The protocol's cells must be counted in addition.
  if (3 * least > 2 * usual) return protocol_;
  if (best != asked_ || repeats != asked_repeats_) {
    asked_ = best;
    asked_repeats_ = repeats;
    answer_ = is_safe(protocol_, repeats, cells_per) && is_safe(best, repeats, cells_per);
  }
  return answer_ ? best : protocol_;
}

// Cells of such bodies are apart by those of the multiples, give or take two, and neighbours by one.
bool CellChoice::is_safe(const ContactCellBits& bits, const Repeats& repeats, std::int32_t cells_per) {
  constexpr std::int64_t kSlack = 3;
  if (*std::max_element(repeats.begin(), repeats.end()) > kMaxRepeats) return false;
  const std::int64_t last = (std::int64_t{1} << bits.all) - 1;
  const auto number = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    return (x + y * (std::int64_t{1} << bits.row) + z * (std::int64_t{1} << bits.layer)) & last;
  };
  const auto apart = [&](std::int64_t multiple) { return cell_of(multiple * (1 << kPlaceBits), cells_per); };
  const auto meets = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    for (std::int64_t i = x - kSlack; i <= x + kSlack; ++i) {
      for (std::int64_t j = y - kSlack; j <= y + kSlack; ++j) {
        for (std::int64_t k = z - kSlack; k <= z + kSlack; ++k) {
          if (number(i, j, k) == 0) return true;
        }
      }
    }
    return false;
  };
  for (std::int64_t x = 0; x <= repeats[0]; ++x) {
    for (std::int64_t y = -repeats[1]; y <= repeats[1]; ++y) {
      for (std::int64_t z = -repeats[2]; z <= repeats[2]; ++z) {
        if ((x != 0 || y != 0 || z != 0) && meets(apart(x), apart(y), apart(z))) return false;
      }
    }
  }
  return true;
}

}  // namespace tandem
