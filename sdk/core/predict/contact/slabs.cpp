#include "sdk/core/predict/contact/slabs.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

// With fewer bodies a slab takes no longer than a thread needs to take it.
constexpr std::uint32_t kLeastBodies = 2048;

}  // namespace

void ContactSlabs::cut(std::span<const std::uint32_t> begin, const ContactCellBits& bits) {
  const std::uint32_t layers = 1U << (bits.all - bits.layer);
  const std::uint32_t target = std::max(kLeastBodies, begin.back() / (kMaxSlabs - 2));
  count_ = 0;
  std::uint32_t first_layer = 0;
  for (std::uint32_t layer = 2; layer + 2 <= layers; ++layer) {
    const std::uint32_t first = begin[std::size_t{first_layer} << bits.layer];
    const std::uint32_t end = begin[std::size_t{layer} << bits.layer];
    if (layer - first_layer < 2 || end - first < target || count_ + 2 > kMaxSlabs) continue;
    slabs_[count_++] = {first, end};
    first_layer = layer;
  }
  slabs_[count_++] = {begin[std::size_t{first_layer} << bits.layer], begin.back()};
  if (count_ > 1 && count_ % 2 == 1) {
    slabs_[count_ - 2].end = slabs_[count_ - 1].end;
    --count_;
  }
  TANDEM_ASSERT((count_ == 1 || count_ % 2 == 0) && slabs_[count_ - 1].end == begin.back());
}

}  // namespace tandem
