#include "sdk/core/lattice/hash.hpp"

#include <algorithm>
#include <bit>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/hash_avx2.hpp"

namespace tandem {

static_assert(std::endian::native == std::endian::little, "columns are hashed in place: little-endian only");

namespace {

using Update = XXH_errorcode (*)(XXH3_state_t*, const void*, std::size_t);

// Both give the same bits; see hash_avx2.hpp.
Update fastest_update() {
#ifdef TANDEM_HASH_AVX2
  if (__builtin_cpu_supports("avx2") != 0) return update_avx2;
#endif
  return XXH3_64bits_update;
}

}  // namespace

struct StateHasher::Impl {
  using Working = std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)>;
  // Leaves of a block: the columns that all groups share, and each group.
  [[nodiscard]] static std::size_t leaves_of(const State& state) {
    std::size_t count = 1;
    for_each_group(state.groups(), [&count](const ChannelGroup&) { ++count; });
    return count;
  }

  // Adds the part of a column, or of several consecutive ones, that belongs to a block.
  void add(XXH3_state_t* h, const auto& column, Slot first, std::uint32_t slots) const {
    const auto part = column.subspan(first, slots);
    update(h, part.data(), part.size_bytes());
  }
  void add_all(XXH3_state_t* h, std::span<const std::byte> columns, const State& state, Slot first,
               std::uint32_t slots) const {
    for (std::size_t at = 0; at < columns.size(); at += state.capacity())
      add(h, columns.subspan(at, state.capacity()), first, slots);
  }

  // The numbers of what a block's leaves were computed from. 0: to be computed anew.
  struct Known {
    std::uint64_t state = 0, codec = 0;
  };

  // A block to be hashed.
  struct Job {
    std::uint32_t block = 0;
    bool only_first = false;  // of its leaves
  };

  // Lists the blocks of which any leaf is to be computed.
  void list_jobs(const ExtraColumns& extra, const HashedNumbers& numbers) {
    jobs.clear();
    for (std::uint32_t block = 0; block < known.size(); ++block) {
      const Known now{number_of(numbers.state, block),
                      extra.codec.empty() ? 1 : number_of(numbers.codec, block)};
      const bool same_state = now.state != 0 && now.state == known[block].state;
      const bool same_codec = now.codec != 0 && now.codec == known[block].codec;
      if (same_state && same_codec) continue;
      known[block] = now;
      jobs.push_back({block, same_state});
    }
  }

  void hash_block(const State& state, const ExtraColumns& extra, const Job& job) {
    const std::uint32_t block = job.block;
    const Slot first = block * kBlockSlots;
    const std::uint32_t slots = std::min(kBlockSlots, state.capacity() - first);
    XXH3_state_t* const h = working[block].get();
    if (job.only_first) {
      XXH3_copyState(h, begun[block].get());
    } else {
      XXH3_64bits_reset(h);
      add(h, state.alive(), first, slots);
      add(h, state.reuse(), first, slots);
      add(h, state.type(), first, slots);
      add(h, state.rest(), first, slots);
      XXH3_copyState(begun[block].get(), h);
    }
    add_all(h, extra.codec, state, first, slots);
    add_all(h, extra.predictor, state, first, slots);
    std::uint64_t* leaf = leaves.data() + block * leaves_of(state);
    *leaf++ = XXH3_64bits_digest(h);
    if (job.only_first) return;
    for_each_group(state.groups(), [&](const ChannelGroup& group) {
      XXH3_64bits_reset(h);
      for_each_column(
          group, [&](std::size_t column, const ColumnRun&) { add(h, state.column(column), first, slots); });
      *leaf++ = XXH3_64bits_digest(h);
    });
  }

  Update update = fastest_update();
  std::vector<Working> working;  // by block
  std::vector<Working>
      begun;  // by block: the first leaf up to the codec's columns, whose ages change most often
  std::vector<std::uint64_t> leaves;
  std::vector<Known> known;  // by block
  std::vector<Job> jobs;     // of the current hash()
  std::uint64_t leaves_hash = 0;
};

StateHasher::StateHasher() : impl_(std::make_unique<Impl>()) {}
StateHasher::StateHasher(StateHasher&&) noexcept = default;
StateHasher& StateHasher::operator=(StateHasher&&) noexcept = default;
StateHasher::~StateHasher() = default;

std::uint64_t StateHasher::hash(const State& state, const ExtraColumns& extra, const RunBlocks& run,
                                const HashedNumbers& numbers) {
  Impl& m = *impl_;
  const std::uint32_t blocks = block_count(state.capacity());
  const std::size_t leaves = blocks * Impl::leaves_of(state);
  TANDEM_ASSERT(extra.codec.size() % state.capacity() == 0 && extra.predictor.size() % state.capacity() == 0);
  TANDEM_ASSERT(numbers.state.empty() || numbers.state.size() == blocks);
  TANDEM_ASSERT(numbers.codec.empty() || numbers.codec.size() == blocks);
  for (auto* const states : {&m.working, &m.begun}) {
    while (states->size() < blocks) states->emplace_back(XXH3_createState(), &XXH3_freeState);
  }
  if (m.known.size() != blocks || m.leaves.size() != leaves) {
    m.known.assign(blocks, {});
    m.leaves.resize(leaves);
    m.jobs.reserve(blocks);
  }
  m.list_jobs(extra, numbers);
  run_jobs(static_cast<std::uint32_t>(m.jobs.size()), run,
           [&](std::uint32_t i) { m.hash_block(state, extra, m.jobs[i]); });
  m.leaves_hash = hash_bytes(std::as_bytes(std::span(m.leaves)));
  return hash_bytes(std::as_bytes(std::span(&m.leaves_hash, 1)));
}

std::uint64_t StateHasher::leaves_hash() const { return impl_->leaves_hash; }

std::uint64_t hash_bytes(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

std::string to_hex(std::uint64_t hash) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text(16, '0');
  for (std::size_t i = 0; i < 16; ++i) text[i] = kDigits[(hash >> (60U - 4U * i)) & 15U];
  return text;
}

}  // namespace tandem
