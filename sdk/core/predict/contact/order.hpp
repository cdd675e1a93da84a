#pragma once
// The order of bodies for the search of pairs: by cells of a grid, which is a torus.

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/block_ledger.hpp"
#include "sdk/core/lattice/run_blocks.hpp"
#include "sdk/core/predict/contact/cell_choice.hpp"
#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/contact/pairs.hpp"
#include "sdk/core/predict/contact/surroundings.hpp"

namespace tandem {

/// Takes bodies from ContactOrder.
class ContactTaker {
 public:
  /// Maximum number of bodies that are taken at once.
  static constexpr std::uint32_t kAtOnce = 64;

  virtual ~ContactTaker() = default;
  /// Of these bodies, the k-th has the place places[k]. Threads may take other bodies at the same time.
  virtual void take(std::span<const ContactBody> bodies, const std::uint32_t* places) = 0;
  /// `count` bodies that were taken change their places: those from `from` on to those from `to` on, which
  /// are lower.
  virtual void move(std::uint32_t from, std::uint32_t to, std::uint32_t count) = 0;
};

/// Puts the bodies of a state into the order of their cells. Allocates at creation only.
class ContactOrder {
 public:
  /// Number of places that a vector may read behind the last body.
  static constexpr std::uint32_t kBeyond = 8;
  /// A body's cell: of p >> shift the part in cells, which are 1 / cells_per wide.
  struct Cells {
    std::uint32_t shift;
    std::int32_t cells_per;  ///< cells per grid unit, in 2^-32
  };
  /// What is put in order. `run` changes no bit of the result.
  struct Input {
    const State& state;
    std::span<const ContactConstants::Type>
        types;  ///< a body of a higher type has the radius of the last one
    Cells cells;
    const RunBlocks& run;
    /// If it is not empty, bodies that no body in motion can touch are left out: by slot, 1 for those that do
    /// not move. Worth it if most rest.
    std::span<const std::uint8_t> at_rest = {};
    /// May be given with at_rest, by block: 1 if nobody moves. Such a block is not read again, as long as it
    /// keeps its number and nobody moves near its bodies.
    std::span<const std::uint8_t> still = {};
    BlockNumbers numbers = {};  ///< of all blocks
    /// True if only bodies that touch now make pairs. Then the cells of flat worlds may be numbered
    /// otherwise than the protocol does, if that makes the same pairs and fewer bodies share a cell: see
    /// CellChoice.
    bool any_cells = false;
    /// If it is not empty, by slot: 1 for bodies that are left out, whoever moves. Not together with at_rest.
    std::span<const std::uint8_t> left_out = {};
  };

  explicit ContactOrder(std::uint32_t capacity);

  /// Gives bodies their places: first come those that take part in pairs, ordered by cell and then by slot
  /// (of a cell, the first ContactGrid::kMaxInCell), then the others, by slot. Returns their number.
  std::uint32_t sort(const Input& input, ContactTaker& taker);
  /// The same; returns the bodies by place.
  std::span<ContactBody> sort(const Input& input);
  /// The protocol's cells, by slot, until the next sort(); all bits set for dead slots.
  std::span<const std::uint32_t> number(const Input& input);
  /// The protocol's numbers of cells.
  [[nodiscard]] const ContactCellBits& protocol_bits() const { return choice_.protocol(); }

  /// By place. A taker may write to the places that it is given, also something else.
  [[nodiscard]] std::span<ContactBody> room() { return bodies_; }
  /// The bits that the last sort() made.
  [[nodiscard]] const ContactCellBits& bits() const { return bits_; }
  /// By cell, and one more: the place of its first body.
  [[nodiscard]] std::span<const std::uint32_t> begin() const { return begin_; }
  [[nodiscard]] std::span<const std::uint32_t> place_cell() const { return place_cell_; }
  /// By slot; a place for those that were left out too, if somebody moves in their run of 64 slots. kBeyond
  /// more elements than slots.
  [[nodiscard]] std::span<const std::uint32_t> place() const { return place_; }

 private:
  static constexpr std::uint32_t kNobody = ~std::uint32_t{0};  // the cell of a slot that takes no part
  static constexpr std::uint32_t kOther = kNobody - 1;  // the place of a body that takes no part in pairs
  static Slot end_of(const State& state, std::uint32_t block) {
    return std::min((block + 1) * kBlockSlots, state.capacity());
  }

  std::uint32_t sort_by(const ContactCellBits& bits, const Input& input, ContactTaker& taker);
  [[nodiscard]] bool choose_few(const Input& input);
  std::uint32_t sort_cells(const Input& input, bool are_all_in, ContactTaker& taker);
  [[nodiscard]] ContactCellBits choose_bits(const Input& input);
  void number(const Input& input, std::uint32_t block);
  void leave_out(const Input& input, std::uint32_t block);
  [[nodiscard]] bool leave_out_beyond_cells(const Input& input);
  void count_bodies(const Input& input, std::uint32_t block);
  void add_moving(const Input& input, std::uint32_t block);
  [[nodiscard]] bool takes_part(const Input& input, std::uint32_t block);
  void keep_near_moving(const Input& input, std::uint32_t block);
  void choose_next_to_moving(const Input& input, std::uint32_t block);
  template <class Work>
  void for_each_chosen(std::uint32_t block, const Work& work) const {
    const std::size_t first = std::size_t{block} * BlockLedger::kRuns;
    const std::size_t end = std::min(first + BlockLedger::kRuns, chosen_.size());
    for (std::size_t word = first; word < end; ++word) {
      for (std::uint64_t bits = chosen_[word]; bits != 0; bits &= bits - 1)
        work(static_cast<Slot>(word * 64 + static_cast<std::size_t>(std::countr_zero(bits))));
    }
  }
  void begin_buckets(std::uint32_t blocks);
  void distribute(const Input& input, std::uint32_t block);
  std::uint32_t sort_few(const Input& input, ContactTaker& taker);
  void give(std::uint32_t first, std::uint32_t end, ContactTaker& taker);
  void arrange(std::uint32_t bucket, ContactTaker& taker);
  void arrange_few(std::uint32_t bucket, ContactTaker& taker);
  void arrange_many(std::uint32_t bucket, ContactTaker& taker);
  void close_gaps(const Input& input, ContactTaker& taker);
  // Returns the number of all bodies.
  std::uint32_t append_others(const Input& input, ContactTaker& taker);

  std::uint32_t side_bits_;  // the protocol's grid has 2^side_bits cells per side
  ContactCellBits bits_;     // of the last sort()
  CellChoice choice_;
  std::vector<CellExtent> extents_;      // by block of slots
  std::uint32_t bucket_bits_;            // 2^bucket_bits consecutive cells are a bucket
  std::vector<std::uint32_t> place_;     // by slot: at first the cell, later the place
  std::vector<std::uint32_t> starts_;    // by block of slots and bucket: where its bodies begin
  std::vector<std::uint32_t> bucket_;    // by bucket, and one more: where it begins
  std::vector<std::uint32_t> in_pairs_;  // by bucket: number of bodies that take part in pairs
  std::vector<std::uint32_t> back_;      // by bucket: by how many places it moves when gaps are closed
  std::vector<std::uint32_t> begin_;     // by cell
  std::vector<std::uint8_t> in_cell_;    // by cell: number of bodies; with few bodies, as the next one
  std::vector<std::uint8_t> rank_;       // by slot: rank among the bodies of its cell
  ContactSurroundings surroundings_;
  bool few_places_ = false;                // what takes part in the current sort() is what choose_few() chose
  std::vector<std::uint64_t> chosen_;      // in it: a bit for each slot that takes part
  std::uint32_t crowded_ = 0;              // for so many steps bodies move in many places
  std::vector<ContactBody> bodies_;        // by place; before, by bucket
  std::vector<std::uint32_t> place_cell_;  // likewise
};

}  // namespace tandem
