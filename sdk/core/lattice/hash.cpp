#include "sdk/core/lattice/hash.hpp"

#include <bit>

#include "sdk/core/lattice/hash_avx2.hpp"

namespace tandem {

static_assert(std::endian::native == std::endian::little, "columns are hashed in place: little-endian only");

namespace {

using Update = XXH_errorcode (*)(XXH3_state_t*, const void*, std::size_t);

// The same bits either way; see hash_avx2.hpp.
Update fastest_update() {
#ifdef TANDEM_HASH_AVX2
  if (__builtin_cpu_supports("avx2") != 0) return update_avx2;
#endif
  return XXH3_64bits_update;
}

}  // namespace

struct StateHasher::Impl {
  XXH3_state_t* state = XXH3_createState();
  Update update = fastest_update();
  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { XXH3_freeState(state); }
};

StateHasher::StateHasher() : impl_(std::make_unique<Impl>()) {}
StateHasher::StateHasher(StateHasher&&) noexcept = default;
StateHasher& StateHasher::operator=(StateHasher&&) noexcept = default;
StateHasher::~StateHasher() = default;

// One stream over all columns, not a hash of hashes: XXH3 takes 64 bytes at a time whatever the columns'
// ends, and columns of a capacity are of fixed length, so nothing has to stand between them. A change of
// order or width breaks every client: idl/PROTOCOL.md, "State hash".
std::uint64_t StateHasher::hash(const State& state, std::span<const std::byte> codec_state) {
  XXH3_state_t* const h = impl_->state;
  XXH3_64bits_reset(h);
  const auto add = [h, update = impl_->update](const auto& column) {
    update(h, column.data(), column.size_bytes());
  };
  add(state.alive());
  add(state.generation());
  add(state.type());
  for (std::size_t i = 0; i < kPositionChannels; ++i) add(state.p(i));
  for (std::size_t i = 0; i < kPositionChannels; ++i) add(state.v(i));
  for (std::size_t i = 0; i < kPositionChannels; ++i) add(state.c(i));
  if (!codec_state.empty()) add(codec_state);
  return XXH3_64bits_digest(h);
}

std::uint64_t hash_bytes(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

std::string to_hex(std::uint64_t hash) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text(16, '0');
  for (std::size_t i = 0; i < 16; ++i) text[i] = kDigits[(hash >> (60U - 4U * i)) & 15U];
  return text;
}

}  // namespace tandem
