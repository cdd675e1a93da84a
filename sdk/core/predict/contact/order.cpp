// Few bodies go to their places at once. More are sorted in two passes, each of which writes to memory that
// the caches hold: they go into some hundred buckets of consecutive cells, block by block of slots, and then
// each bucket is put in order by itself.
#include "sdk/core/predict/contact/order.hpp"

#include <array>
#include <cstring>
#include <numeric>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kMaxBucketBits = 11;                     // at most 2^11 buckets
constexpr std::uint32_t kLeastCellBits = 11, kMaxCellBits = 13;  // of a bucket
constexpr std::uint32_t kFew = 3072;  // bodies that are put in order in a copy: 96 KB
constexpr std::uint32_t kBucketsAtOnce = 4;
constexpr std::uint32_t kUnplaced = 1U << 31U;

std::uint32_t side_bits_for(std::uint32_t capacity) {
  std::uint32_t bits = 2;
  while ((1U << (3 * bits)) < 2 * capacity) ++bits;
  return bits;
}

std::uint32_t bucket_bits_for(std::uint32_t side_bits) {
  const std::uint32_t bits = 3 * side_bits;
  return std::min(bits, std::max(kLeastCellBits, bits - std::min(bits, kMaxBucketBits)));
}

struct CellNumbers {
  std::uint32_t shift;
  ContactCellBits bits;
  std::int32_t cells_per;
};

TANDEM_VECTOR_CLONES void number_cells(const CellNumbers& how, const std::uint8_t* __restrict alive,
                                       const std::int32_t* __restrict x, const std::int32_t* __restrict y,
                                       const std::int32_t* __restrict z, std::uint32_t* __restrict cell,
                                       std::size_t count) {
  const std::uint32_t last = (1U << how.bits.all) - 1;
  const std::uint32_t row = how.bits.row, layer = how.bits.layer;
  const auto along = [shift = how.shift, cells_per = how.cells_per](std::int32_t p) {
    return static_cast<std::uint32_t>(std::int64_t{p >> shift} * cells_per >> 32);
  };
  for (std::size_t s = 0; s < count; ++s) {
    const std::uint32_t dead = std::uint32_t{alive[s]} - 1;  // all bits, or none
    cell[s] = ((along(x[s]) + (along(y[s]) << row) + (along(z[s]) << layer)) & last) | dead;
  }
}

TANDEM_VECTOR_CLONES void extend(const std::int32_t* p, std::size_t count, std::int32_t& low,
                                 std::int32_t& high) {
  std::int32_t least = low, most = high;
  for (std::size_t s = 0; s < count; ++s) {
    least = std::min(least, p[s]);
    most = std::max(most, p[s]);
  }
  low = least;
  high = most;
}

// The places of the cells' first bodies, and the place behind the last body, eight cells at a time: the
// product has in each byte the sum of the bytes up to it.
TANDEM_VECTOR_CLONES std::uint32_t begin_cells(const std::uint8_t* in_cell, std::uint32_t sum,
                                               std::span<std::uint32_t> begin) {
  static_assert(8 * ContactGrid::kMaxInCell < 256);
  for (std::size_t cell = 0; cell < begin.size(); cell += 8) {
    std::uint64_t counts = 0;
    std::memcpy(&counts, &in_cell[cell], sizeof counts);
    const std::uint64_t sums = counts * 0x0101010101010101U;
    std::array<std::uint8_t, 8> before{};
    const std::uint64_t shifted = sums << 8U;
    std::memcpy(before.data(), &shifted, sizeof shifted);
    for (std::size_t i = 0; i < 8; ++i) begin[cell + i] = sum + before[i];
    sum += static_cast<std::uint32_t>(sums >> 56U);
  }
  return sum;
}

// The bodies of a state.
class Bodies {
 public:
  explicit Bodies(const ContactOrder::Input& input)
      : p_{input.state.p(0).data(), input.state.p(1).data(), input.state.p(2).data()},
        v_{input.state.v(0).data(), input.state.v(1).data(), input.state.v(2).data()},
        type_(input.state.type().data()),
        types_(input.types.data()),
        last_type_(static_cast<TypeId>(input.types.size() - 1)) {}

  [[nodiscard]] ContactBody at(Slot s) const {
    return {{p_[0][s], p_[1][s], p_[2][s]},
            types_[std::min(type_[s], last_type_)].radius,
            {v_[0][s], v_[1][s], v_[2][s]},
            s};
  }

 private:
  std::array<const std::int32_t*, 3> p_, v_;
  const TypeId* type_;
  const ContactConstants::Type* types_;
  TypeId last_type_;
};

}  // namespace

ContactOrder::ContactOrder(std::uint32_t capacity)
    : side_bits_(side_bits_for(capacity)),
      choice_(side_bits_),
      extents_(block_count(capacity)),
      bucket_bits_(bucket_bits_for(side_bits_)),
      place_(capacity + kBeyond),
      bucket_((std::size_t{1} << (3 * side_bits_ - bucket_bits_)) + 1),
      in_pairs_(bucket_.size() - 1),
      back_(in_pairs_.size()),
      begin_((std::size_t{1} << (3 * side_bits_)) + 1),
      surroundings_(3 * side_bits_, block_count(capacity)),
      bodies_(capacity),
      place_cell_(capacity) {
  if (block_count(capacity) > 1) {
    starts_.resize(in_pairs_.size() * block_count(capacity));
    chosen_.resize((capacity + 63) / 64);
  } else {
    in_cell_.resize(begin_.size() - 1);
    rank_.resize(capacity);
  }
}

std::span<const std::uint32_t> ContactOrder::number(const Input& input) {
  bits_ = choice_.protocol();
  run_jobs(block_count(input.state.capacity()), input.run,
           [&](std::uint32_t block) { number(input, block); });
  return std::span(place_).first(input.state.capacity());
}

std::span<ContactBody> ContactOrder::sort(const Input& input) {
  struct Keeper final : ContactTaker {
    explicit Keeper(std::span<ContactBody> bodies) : kept(bodies) {}
    void take(std::span<const ContactBody> bodies, const std::uint32_t* places) override {
      for (std::size_t k = 0; k < bodies.size(); ++k) kept[places[k]] = bodies[k];
    }
    void move(std::uint32_t from, std::uint32_t to, std::uint32_t count) override {
      std::copy_n(kept.begin() + from, count, kept.begin() + to);
    }
    std::span<ContactBody> kept;
  };
  Keeper keeper(bodies_);
  return std::span(bodies_).first(sort(input, keeper));
}

std::uint32_t ContactOrder::sort(const Input& input, ContactTaker& taker) {
  TANDEM_ASSERT(input.still.empty() || !input.at_rest.empty());
  TANDEM_ASSERT(input.left_out.empty() || input.at_rest.empty());
  if (choose_few(input)) return sort_cells(input, true, taker);
  const ContactCellBits chosen = choose_bits(input);
  const std::uint32_t count = sort_by(chosen, input, taker);
  if (chosen == choice_.protocol() || begin_.back() == bucket_.back()) return count;
  // A cell has more bodies than the search can take, although the protocol's cells have not.
  choice_.refuse();
  return sort_by(choice_.protocol(), input, taker);
}

ContactCellBits ContactOrder::choose_bits(const Input& input) {
  if (!input.any_cells) return choice_.protocol();
  run_jobs(static_cast<std::uint32_t>(extents_.size()), input.run, [&](std::uint32_t block) {
    const Slot first = block * kBlockSlots;
    CellExtent extent;  // of dead slots too, which are at 0
    for (std::size_t i = 0; i < 3; ++i)
      extend(&input.state.p(i)[first], end_of(input.state, block) - first, extent.low[i], extent.high[i]);
    extents_[block] = extent;
  });
  CellExtent all;
  for (const CellExtent& extent : extents_) all.add(extent);
  return choice_.choose(all, input.cells.shift, input.cells.cells_per);
}

std::uint32_t ContactOrder::sort_by(const ContactCellBits& bits, const Input& input, ContactTaker& taker) {
  const std::uint32_t blocks = block_count(input.state.capacity());
  bits_ = bits;
  bool are_all_in = true;
  if (bits != choice_.protocol()) are_all_in = leave_out_beyond_cells(input);
  few_places_ = false;
  if (!input.at_rest.empty()) surroundings_.begin(bits, false);
  run_jobs(blocks, input.run, [&](std::uint32_t block) {
    number(input, block);
    for (Slot s = block * kBlockSlots, end = end_of(input.state, block); !are_all_in && s < end; ++s) {
      if (place_cell_[s] != 0) place_[s] = kOther;
    }
    leave_out(input, block);
    if (input.at_rest.empty() && blocks > 1) count_bodies(input, block);
  });
  if (!input.at_rest.empty()) {
    for (std::uint32_t block = 0; block < blocks; ++block) add_moving(input, block);
    run_jobs(blocks, input.run, [&](std::uint32_t block) {
      keep_near_moving(input, block);
      if (blocks > 1) count_bodies(input, block);
    });
  }
  return blocks == 1 ? sort_few(input, taker) : sort_cells(input, are_all_in, taker);
}

// Puts the bodies in order whose cells are known and counted.
std::uint32_t ContactOrder::sort_cells(const Input& input, bool are_all_in, ContactTaker& taker) {
  const std::uint32_t blocks = block_count(input.state.capacity());
  begin_buckets(blocks);
  run_jobs(blocks, input.run, [&](std::uint32_t block) { distribute(input, block); });
  const auto buckets = static_cast<std::uint32_t>(in_pairs_.size());
  run_jobs(buckets / kBucketsAtOnce + 1, input.run, [&](std::uint32_t part) {
    const std::uint32_t end = std::min(buckets, (part + 1) * kBucketsAtOnce);
    for (std::uint32_t bucket = part * kBucketsAtOnce; bucket < end; ++bucket) arrange(bucket, taker);
  });
  const std::uint32_t count = bucket_.back();
  begin_.back() = 0;
  for (const std::uint32_t in_bucket : in_pairs_) begin_.back() += in_bucket;
  if (begin_.back() < count) {
    if (bits_ != choice_.protocol()) return count;
    close_gaps(input, taker);
    return append_others(input, taker);
  }
  return are_all_in ? count : append_others(input, taker);
}

// Marks the bodies that take no part in pairs with 1, by slot, in memory for what is sorted later: those that
// are not among the first of a cell of the protocol. Returns false if there are any.
bool ContactOrder::leave_out_beyond_cells(const Input& input) {
  const ContactCellBits chosen = std::exchange(bits_, choice_.protocol());
  const std::uint32_t capacity = input.state.capacity();
  const std::uint32_t blocks = block_count(capacity);
  run_jobs(blocks, input.run, [&](std::uint32_t block) {
    number(input, block);
    const Slot first = block * kBlockSlots;
    std::fill_n(&place_cell_[first], end_of(input.state, block) - first, 0U);
  });
  bits_ = chosen;
  // Each part of the cells is counted in the order of slots.
  constexpr std::uint32_t kMaxPartBits = 2;
  std::array<std::uint8_t, 1U << kMaxPartBits> is_any{};
  const std::uint32_t bits_of_parts = input.run ? kMaxPartBits : 0;
  auto* const in_cell = reinterpret_cast<std::uint8_t*>(begin_.data());
  const std::uint32_t part_bits = bits_.all - bits_of_parts;
  run_jobs(1U << bits_of_parts, input.run, [&](std::uint32_t part) {
    std::fill_n(in_cell + (std::size_t{part} << part_bits), std::size_t{1} << part_bits, std::uint8_t{0});
    for (Slot s = 0; s < capacity; ++s) {
      const std::uint32_t cell = place_[s];
      if (cell >> part_bits != part) continue;
      std::uint8_t& so_far = in_cell[cell];
      if (so_far == ContactGrid::kMaxInCell) {
        place_cell_[s] = 1;
        is_any[part] = 1;
      } else {
        ++so_far;
      }
    }
  });
  return std::find(is_any.begin(), is_any.end(), 1) == is_any.end();
}

void ContactOrder::number(const Input& input, std::uint32_t block) {
  const Slot first = block * kBlockSlots;
  const State& state = input.state;
  number_cells({input.cells.shift, bits_, input.cells.cells_per}, &state.alive()[first], &state.p(0)[first],
               &state.p(1)[first], &state.p(2)[first], &place_[first], end_of(state, block) - first);
}

void ContactOrder::leave_out(const Input& input, std::uint32_t block) {
  if (input.left_out.empty()) return;
  for (Slot s = block * kBlockSlots, end = end_of(input.state, block); s < end; ++s) {
    if (input.left_out[s] != 0) place_[s] = kNobody;
  }
}

void ContactOrder::count_bodies(const Input& input, std::uint32_t block) {
  std::uint32_t* const counts = &starts_[block * in_pairs_.size()];
  std::fill_n(counts, in_pairs_.size(), 0U);
  const std::uint32_t bits = bucket_bits_;
  for (Slot s = block * kBlockSlots, end = end_of(input.state, block); s < end; ++s) {
    if (const std::uint32_t cell = place_[s]; cell < kOther) ++counts[cell >> bits];
  }
}

void ContactOrder::add_moving(const Input& input, std::uint32_t block) {
  for (Slot s = block * kBlockSlots, end = end_of(input.state, block); s < end; ++s) {
    if (input.at_rest[s] == 0 && place_[s] < kOther) surroundings_.add(place_[s]);
  }
}

// Leaves out the bodies of a block that nobody in motion can touch.
void ContactOrder::keep_near_moving(const Input& input, std::uint32_t block) {
  for (Slot s = block * kBlockSlots, end = end_of(input.state, block); s < end; ++s) {
    if (place_[s] < kOther && !surroundings_.is_near(place_[s])) place_[s] = kNobody;
  }
}

// From the number of bodies to where they begin: bucket by bucket, in each of them block by block.
void ContactOrder::begin_buckets(std::uint32_t blocks) {
  const std::size_t buckets = in_pairs_.size();
  std::fill(bucket_.begin(), bucket_.end(), 0U);
  for (std::uint32_t block = 0; block < blocks; ++block) {
    for (std::size_t b = 0; b < buckets; ++b) bucket_[b] += starts_[block * buckets + b];
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& begin : bucket_) {
    const std::uint32_t count = begin;
    begin = sum;
    sum += count;
  }
  // in_pairs_ has where the next block's bodies begin.
  std::copy_n(bucket_.begin(), buckets, in_pairs_.begin());
  for (std::uint32_t block = 0; block < blocks; ++block) {
    for (std::size_t b = 0; b < buckets; ++b) {
      const std::uint32_t count = starts_[block * buckets + b];
      starts_[block * buckets + b] = in_pairs_[b];
      in_pairs_[b] += count;
    }
  }
}

// The loop reads nothing of this object, because the compiler would read it again after every write.
void ContactOrder::distribute(const Input& input, std::uint32_t block) {
  const Bodies bodies(input);
  std::uint32_t* const cells = place_.data();
  std::uint32_t* const place_cell = place_cell_.data();
  ContactBody* const room = bodies_.data();
  std::uint32_t* const starts = &starts_[block * in_pairs_.size()];
  const std::uint32_t bits = bucket_bits_;
  const auto put = [=, &bodies](Slot s, std::uint32_t cell) {
    const std::uint32_t at = starts[cell >> bits]++;
    place_cell[at] = cell;
    room[at] = bodies.at(s);
  };
  if (few_places_) return for_each_chosen(block, [&](Slot s) { put(s, cells[s]); });
  for (Slot s = block * kBlockSlots, end = end_of(input.state, block); s < end; ++s) {
    const std::uint32_t cell = cells[s];
    if (cell < kOther) {
      put(s, cell);
    } else if (cell == kNobody) {
      cells[s] = 0;
    }
  }
}

// Puts the bodies of a bucket in order.
void ContactOrder::arrange(std::uint32_t bucket, ContactTaker& taker) {
  const std::uint32_t first = bucket_[bucket];
  const std::uint32_t count = bucket_[bucket + 1] - first;
  if (count == 0) {
    std::fill_n(&begin_[std::size_t{bucket} << bucket_bits_], std::size_t{1} << bucket_bits_, first);
    in_pairs_[bucket] = 0;
  } else if (count <= kFew) {
    arrange_few(bucket, taker);
  } else {
    arrange_many(bucket, taker);
  }
}

// In a copy, because what the taker writes may lie where the bodies did.
void ContactOrder::arrange_few(std::uint32_t bucket, ContactTaker& taker) {
  const std::uint32_t first = bucket_[bucket];
  std::uint32_t count = bucket_[bucket + 1] - first;
  const std::uint32_t cells = 1U << bucket_bits_;
  const std::uint32_t first_cell = bucket << bucket_bits_;
  std::uint32_t* const begin = &begin_[first_cell];
  std::array<std::uint8_t, 1U << kMaxCellBits> in_cell;
  std::array<ContactBody, kFew> bodies;
  std::array<std::uint32_t, kFew> cell, place;
  std::fill_n(in_cell.begin(), cells, std::uint8_t{0});
  std::copy_n(&bodies_[first], count, bodies.begin());
  bool all_in_pairs = true;
  for (std::uint32_t i = 0; i < count; ++i) {
    cell[i] = place_cell_[first + i];
    std::uint8_t& so_far = in_cell[cell[i] & (cells - 1)];
    place[i] = so_far;
    const bool in_pairs = so_far < ContactGrid::kMaxInCell;
    so_far = static_cast<std::uint8_t>(so_far + static_cast<unsigned>(in_pairs));
    all_in_pairs &= in_pairs;
  }
  in_pairs_[bucket] = begin_cells(in_cell.data(), first, {begin, cells}) - first;
  if (!all_in_pairs) {
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (place[i] == ContactGrid::kMaxInCell) {
        place_[bodies[i].slot] = kOther;
        continue;
      }
      bodies[kept] = bodies[i];
      cell[kept] = cell[i];
      place[kept++] = place[i];
    }
    count = kept;
  }
  std::uint32_t* const place_cell = place_cell_.data();
  std::uint32_t* const place_of_slot = place_.data();
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t to = place[i] + begin[cell[i] - first_cell];
    place[i] = to;
    place_cell[to] = cell[i];
    place_of_slot[bodies[i].slot] = to;
  }
  for (std::uint32_t i = 0; i < count; i += ContactTaker::kAtOnce)
    taker.take(std::span(bodies).subspan(i, std::min(ContactTaker::kAtOnce, count - i)), &place[i]);
}

// In place: each body goes where it belongs and takes the one from there along. Those that take no part in
// pairs go behind the others.
void ContactOrder::arrange_many(std::uint32_t bucket, ContactTaker& taker) {
  const std::uint32_t first = bucket_[bucket];
  const std::uint32_t end = bucket_[bucket + 1];
  const std::uint32_t cells = 1U << bucket_bits_;
  const std::uint32_t first_cell = bucket << bucket_bits_;
  std::uint32_t* const begin = &begin_[first_cell];
  std::array<std::uint8_t, 1U << kMaxCellBits> in_cell;
  std::fill_n(in_cell.begin(), cells, std::uint8_t{0});
  std::uint32_t* const key = place_cell_.data();
  for (std::uint32_t at = first; at < end; ++at) {
    const std::uint32_t cell = key[at] - first_cell;
    std::uint8_t& so_far = in_cell[cell];
    key[at] = cell | std::uint32_t{so_far} << kMaxCellBits;
    so_far = static_cast<std::uint8_t>(so_far + static_cast<unsigned>(so_far < ContactGrid::kMaxInCell));
  }
  const std::uint32_t end_of_pairs = begin_cells(in_cell.data(), first, {begin, cells});
  in_pairs_[bucket] = end_of_pairs - first;
  std::uint32_t next_other = end_of_pairs;
  for (std::uint32_t at = first; at < end; ++at) {
    const std::uint32_t rank = key[at] >> kMaxCellBits;
    const bool other = rank == ContactGrid::kMaxInCell;
    const std::uint32_t to = other ? next_other++ : begin[key[at] & ((1U << kMaxCellBits) - 1)] + rank;
    place_[bodies_[at].slot] = other ? kOther : to;
    key[at] = to | kUnplaced;
  }
  for (std::uint32_t at = first; at < end; ++at) {
    if ((key[at] & kUnplaced) == 0) continue;
    ContactBody carried = bodies_[at];
    for (std::uint32_t to = key[at] & ~kUnplaced;;) {
      const std::uint32_t next = key[to];
      std::swap(carried, bodies_[to]);
      key[to] = 0;
      if (to == at) break;
      to = next & ~kUnplaced;
    }
  }
  for (std::uint32_t cell = 0; cell < cells; ++cell)
    std::fill_n(&key[begin[cell]], in_cell[cell], first_cell + cell);
  give(first, end_of_pairs, taker);
}

// Has bodies taken that are where they belong.
void ContactOrder::give(std::uint32_t first, std::uint32_t end, ContactTaker& taker) {
  std::array<ContactBody, ContactTaker::kAtOnce> bodies;
  std::array<std::uint32_t, ContactTaker::kAtOnce> place;
  for (; first < end; first += ContactTaker::kAtOnce) {
    const std::uint32_t count = std::min(ContactTaker::kAtOnce, end - first);
    std::copy_n(&bodies_[first], count, bodies.begin());
    std::iota(place.begin(), place.end(), first);
    taker.take(std::span(bodies).first(count), place.data());
  }
}

std::uint32_t ContactOrder::sort_few(const Input& input, ContactTaker& taker) {
  const std::uint32_t capacity = input.state.capacity();
  std::uint32_t* const places = place_.data();
  std::uint32_t* const place_cell = place_cell_.data();
  std::uint8_t* const in_cell = in_cell_.data();
  std::fill(in_cell_.begin(), in_cell_.end(), std::uint8_t{0});
  std::uint32_t in_cells = 0;
  for (Slot s = 0; s < capacity; ++s) {
    if (places[s] >= kOther) continue;
    ++in_cells;
    std::uint8_t& so_far = in_cell[places[s]];
    rank_[s] = so_far;
    so_far = static_cast<std::uint8_t>(so_far + static_cast<unsigned>(so_far < ContactGrid::kMaxInCell));
  }
  begin_.back() = begin_cells(in_cell, 0, std::span(begin_).first(in_cell_.size()));
  bucket_.back() = in_cells;  // as if there were buckets
  std::uint32_t count = begin_.back();
  const Bodies bodies(input);
  const std::uint32_t* const begin = begin_.data();
  const std::uint8_t* const rank = rank_.data();
  ContactBody* const room = bodies_.data();
  for (Slot s = 0; s < capacity; ++s) {
    const std::uint32_t cell = places[s];
    if (cell == kNobody) {
      places[s] = 0;
      continue;
    }
    const bool in_pairs = cell != kOther && rank[s] < ContactGrid::kMaxInCell;
    const std::uint32_t place = in_pairs ? begin[cell] + rank[s] : count++;
    places[s] = place;
    place_cell[place] = cell;
    room[place] = bodies.at(s);
  }
  give(0, count, taker);
  return count;
}

// Moves the buckets' bodies together, where others that take no part in pairs lay between them.
void ContactOrder::close_gaps(const Input& input, ContactTaker& taker) {
  std::uint32_t end = 0;
  for (std::size_t bucket = 0; bucket < in_pairs_.size(); ++bucket) {
    back_[bucket] = bucket_[bucket] - end;
    end += in_pairs_[bucket];
  }
  run_jobs(block_count(input.state.capacity()), input.run, [&](std::uint32_t block) {
    const auto go_back = [&](Slot s) {
      if (place_[s] != kOther) place_[s] -= back_[place_cell_[place_[s]] >> bucket_bits_];
    };
    if (few_places_) return for_each_chosen(block, go_back);
    for (Slot s = block * kBlockSlots, last = end_of(input.state, block); s < last; ++s) go_back(s);
  });
  for (std::size_t bucket = 0; bucket < in_pairs_.size(); ++bucket) {
    const std::uint32_t back = back_[bucket];
    if (back == 0) continue;
    const std::uint32_t from = bucket_[bucket];
    taker.move(from, from - back, in_pairs_[bucket]);
    std::copy_n(&place_cell_[from], in_pairs_[bucket], &place_cell_[from - back]);
    for (std::uint32_t& place :
         std::span(begin_).subspan(bucket << bucket_bits_, std::size_t{1} << bucket_bits_))
      place -= back;
  }
}

std::uint32_t ContactOrder::append_others(const Input& input, ContactTaker& taker) {
  const Bodies of(input);
  std::array<ContactBody, ContactTaker::kAtOnce> bodies;
  std::array<std::uint32_t, ContactTaker::kAtOnce> place;
  std::uint32_t next = begin_.back();
  std::uint32_t count = 0;
  const auto append = [&](Slot s) {
    if (place_[s] != kOther) return;
    bodies[count] = of.at(s);
    place_[s] = place[count] = next++;
    if (++count < ContactTaker::kAtOnce) return;
    taker.take(bodies, place.data());
    count = 0;
  };
  if (few_places_) {
    for (std::uint32_t block = 0; block < block_count(input.state.capacity()); ++block)
      for_each_chosen(block, append);
  } else {
    for (Slot s = 0; s < input.state.capacity(); ++s) append(s);
  }
  taker.take(std::span(bodies).first(count), place.data());
  return next;
}

}  // namespace tandem
