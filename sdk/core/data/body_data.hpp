#pragma once
// The data of all bodies that the server's application declared: part of the agreed state, never predicted.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/data/data_models.hpp"
#include "sdk/core/data/data_shape.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// What a frame changes of the data: the slots, ascending, and their records, one after another.
struct DataChanges {
  std::vector<Slot> slots;
  std::vector<std::byte> records;
};

/// Holds a record and an age for each slot, both zero for a dead one. The age counts the frames since the
/// record changed or the body appeared, up to 254. Server and clients hold the same after each frame, as its
/// hash proves. Not thread-safe.
///
/// Each frame: encode() or decode(), which change nothing, then apply(). Allocates only for more changes than
/// ever before.
class BodyData {
 public:
  /// `fields`: as check_data_fields() accepts them, at least one.
  BodyData(std::span<const DataField> fields, std::uint32_t capacity);

  [[nodiscard]] std::size_t record_bytes() const { return shape_.record_bytes(); }
  /// By slot, one after another.
  [[nodiscard]] std::span<const std::byte> records() const { return records_; }
  [[nodiscard]] std::span<const std::byte> record(Slot slot) const {
    return std::span(records_).subspan(slot * record_bytes(), record_bytes());
  }
  [[nodiscard]] std::span<const std::uint8_t> ages() const { return ages_; }

  /// The slots to which the last frame told other data, ascending. Others may have appeared without any.
  [[nodiscard]] std::span<const Slot> changed() const { return changes_.slots; }

  /// Begins with these records, as if every body had appeared now. Records of dead slots are ignored.
  void start(std::span<const std::byte> records, std::span<const std::uint8_t> alive);

  /// The next frame: which slots live after its lifecycle records, and those records.
  struct Lives {
    std::span<const std::uint8_t> alive;  ///< after the records
    std::span<const LifecycleRecord> lifecycle;
  };
  /// Lists into `slots` the living ones whose record in `target` is another than here; ascending.
  void list_changed(std::span<const std::byte> target, const Lives& lives, std::vector<Slot>& slots);
  /// Writes the body of section 0x8b, by which the listed slots (some of list_changed(), ascending, at least
  /// one) get their records in `target`. Returns a view that is valid until the next call.
  std::span<const std::byte> encode(std::span<const std::byte> target, std::span<const Slot> slots,
                                    const Lives& lives);
  /// Reads such a body; untrusted. Errors: kMalformed.
  [[nodiscard]] Result<void> decode(std::span<const std::byte> section, const Lives& lives);
  /// A frame without a section.
  void keep();
  /// Applies the frame: what the last encode(), decode() or keep() found, and the lifecycle records.
  void apply(const Lives& lives);

  /// The data hash: idl/PROTOCOL.md, "State hash".
  [[nodiscard]] std::uint64_t hash();

  /// Maximum size of what encode() or write() write.
  [[nodiscard]] std::size_t bytes_bound() const;
  /// The body of section 0x8f.
  void write(std::span<const std::uint8_t> alive, ByteWriter& out) const;
  /// Replaces everything by such a body; untrusted. Errors: kMalformed, then the content is undefined.
  [[nodiscard]] Result<void> read(std::span<const std::byte> section, std::span<const std::uint8_t> alive);

 private:
  struct Block {
    std::uint8_t quiet = 0;  ///< frames without a change, up to when all ages stand still
    bool records_changed = true, ages_changed = true;
  };
  static constexpr std::uint8_t kMaxAge = 254;

  [[nodiscard]] std::uint32_t capacity() const { return static_cast<std::uint32_t>(ages_.size()); }
  std::byte* at(Slot slot) { return records_.data() + slot * record_bytes(); }
  /// Marks the slots whose body ends or begins with these records.
  void mark_renewed(const Lives& lives);
  void clear_marks(const Lives& lives);
  void grow_older(std::uint32_t block, std::span<const std::uint8_t> alive);
  void put(Slot slot, std::span<const std::byte> record);
  template <class Coder, class Source>
  bool code_section(Coder& coder, DataModels& models, const Lives& lives, Source& source);
  template <class Coder>
  bool code_record(Coder& coder, DataModels& models, const std::byte* before, std::byte* record) const;
  template <class Coder, class Records, class Ages>
  static bool code_all(Coder& coder, const DataShape& shape, std::span<const std::uint8_t> alive,
                       Records records, Ages ages, DataModels& models);

  DataShape shape_;
  std::vector<std::byte> records_;
  std::vector<std::uint8_t> ages_;
  std::vector<std::uint8_t> renewed_;  ///< by slot, only within a call
  DataModels models_;
  std::vector<Block> blocks_;
  std::vector<std::uint64_t> leaves_;
  std::vector<std::byte> written_;
  // Of the frame that is not applied yet.
  DataModels next_models_;
  DataChanges changes_;
  bool is_coded_ = false;
};

}  // namespace tandem
