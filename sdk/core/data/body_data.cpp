#include "sdk/core/data/body_data.hpp"

#include <algorithm>
#include <array>

#include "sdk/core/codec/tracker/models.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/hash.hpp"

namespace tandem {
namespace {

constexpr std::array<std::byte, kMaxDataBytes> kNothing{};

// What code_section() asks: an encoder's answers.
struct Wanted {
  std::span<const std::byte> target;
  std::span<const Slot> slots;
  std::size_t record_bytes;
  std::size_t next = 0;

  [[nodiscard]] bool changes_before(Slot end) const { return next < slots.size() && slots[next] < end; }
  [[nodiscard]] bool changes(Slot slot) const { return next < slots.size() && slots[next] == slot; }
  void take(Slot slot, std::byte* record) const {
    std::copy_n(target.data() + slot * record_bytes, record_bytes, record);
  }
  void keep(Slot /*slot*/, const std::byte* /*record*/) { ++next; }
};

// Likewise a decoder's: none, and the section's are kept.
struct Found {
  DataChanges& into;
  std::size_t record_bytes;

  [[nodiscard]] static bool changes_before(Slot /*end*/) { return false; }
  [[nodiscard]] static bool changes(Slot /*slot*/) { return false; }
  void take(Slot /*slot*/, std::byte* /*record*/) const {}
  void keep(Slot slot, const std::byte* record) {
    into.slots.push_back(slot);
    into.records.insert(into.records.end(), record, record + record_bytes);
  }
};

tl::unexpected<Error> malformed(const char* what) { return fail(ErrorCode::kMalformed, what); }

}  // namespace

BodyData::BodyData(std::span<const DataField> fields, std::uint32_t capacity)
    : shape_(fields),
      records_(capacity * shape_.record_bytes()),
      ages_(capacity),
      renewed_(capacity),
      blocks_(block_count(capacity)),
      leaves_(2 * blocks_.size()) {}

void BodyData::start(std::span<const std::byte> records, std::span<const std::uint8_t> alive) {
  TANDEM_ASSERT(records.size() == records_.size() && alive.size() == ages_.size());
  std::fill(ages_.begin(), ages_.end(), std::uint8_t{0});
  for (Slot slot = 0; slot < capacity(); ++slot) {
    const auto record = alive[slot] != 0 ? records.subspan(slot * record_bytes(), record_bytes())
                                         : std::span(kNothing).first(record_bytes());
    std::copy(record.begin(), record.end(), at(slot));
  }
  models_ = {};
  std::fill(blocks_.begin(), blocks_.end(), Block{});
}

void BodyData::mark_renewed(const Lives& lives) {
  for (const LifecycleRecord& record : lives.lifecycle) {
    if (record.kind == LifecycleKind::kSpawn || record.kind == LifecycleKind::kDespawn)
      renewed_[record.slot] = 1;
  }
}

void BodyData::clear_marks(const Lives& lives) {
  for (const LifecycleRecord& record : lives.lifecycle) renewed_[record.slot] = 0;
}

void BodyData::list_changed(std::span<const std::byte> target, const Lives& lives, std::vector<Slot>& slots) {
  TANDEM_ASSERT(target.size() == records_.size() && lives.alive.size() == ages_.size());
  slots.clear();
  mark_renewed(lives);
  const std::size_t bytes = record_bytes();
  for (Slot first = 0; first < capacity(); first += kBlockSlots) {
    const Slot end = std::min(first + kBlockSlots, capacity());
    const bool is_same = lives.lifecycle.empty() &&
                         std::equal(target.data() + first * bytes, target.data() + end * bytes, at(first));
    for (Slot slot = first; slot < end && !is_same; ++slot) {
      const std::byte* const before = renewed_[slot] != 0 ? kNothing.data() : at(slot);
      if (lives.alive[slot] != 0 && !std::equal(before, before + bytes, target.data() + slot * bytes))
        slots.push_back(slot);
    }
  }
  clear_marks(lives);
}

// Codes a record that is not `before`. Returns false if a decoder read what no encoder writes.
template <class Coder>
bool BodyData::code_record(Coder& coder, DataModels& models, const std::byte* before,
                           std::byte* record) const {
  bool earlier = false;
  for (std::size_t field = 0; field < shape_.fields(); ++field) {
    const std::size_t first = shape_.first_of(field), end = shape_.first_of(field + 1);
    const auto moves = [&](std::size_t i) {
      return shape_.numbers()[i].value_in(before) != shape_.numbers()[i].value_in(record);
    };
    bool changes = false;
    for (std::size_t i = first; i < end; ++i) changes |= moves(i);
    const bool must = field + 1 == shape_.fields() && !earlier;
    changes = must || coder.decide(changes, models.field[2 * field + (earlier ? 1 : 0)]);
    bool some = false;
    for (std::size_t i = first; i < end; ++i) {
      const DataNumber& number = shape_.numbers()[i];
      const std::uint32_t from = number.value_in(before);
      std::int64_t step = 0;
      if (changes) step = code_number(coder, models.numbers[i], number.step(from, number.value_in(record)));
      if (!number.is_step(step)) return false;
      some |= step != 0;
      number.put(number.stepped(from, step), record);
    }
    if (some != changes) return false;
    earlier |= changes;
  }
  return true;
}

template <class Coder, class Source>
bool BodyData::code_section(Coder& coder, DataModels& models, const Lives& lives, Source& source) {
  bool any = false;
  for (Slot first = 0; first < capacity(); first += kBlockSlots) {
    const Slot end = std::min(first + kBlockSlots, capacity());
    const auto* const alive = lives.alive.data();
    if (std::all_of(alive + first, alive + end, [](std::uint8_t one) { return one == 0; })) continue;
    any = coder.decide(source.changes_before(end), models.any[any ? 1 : 0]);
    if (!any) continue;
    bool before = false, one = false;
    for (Slot slot = first; slot < end; ++slot) {
      if (alive[slot] == 0) continue;
      const bool is_new = renewed_[slot] != 0;
      const std::uint32_t age = tracker_age_buckets[is_new ? 0 : ages_[slot]];
      before = coder.decide(source.changes(slot), models.changed[2 * age + (before ? 1 : 0)]);
      if (!before) continue;
      one = true;
      std::array<std::byte, kMaxDataBytes> record{};
      source.take(slot, record.data());
      if (!code_record(coder, models, is_new ? kNothing.data() : at(slot), record.data())) return false;
      source.keep(slot, record.data());
    }
    if (!one) return false;
  }
  return true;
}

std::span<const std::byte> BodyData::encode(std::span<const std::byte> target, std::span<const Slot> slots,
                                            const Lives& lives) {
  TANDEM_ASSERT(target.size() == records_.size() && !slots.empty());
  mark_renewed(lives);
  changes_.slots.assign(slots.begin(), slots.end());
  changes_.records.clear();
  for (const Slot slot : slots) {
    const auto record = target.subspan(slot * record_bytes(), record_bytes());
    changes_.records.insert(changes_.records.end(), record.begin(), record.end());
  }
  // Few frames need as much as the bound, so memory grows when one does.
  for (std::size_t room = std::max<std::size_t>(written_.size(), 1024);; room *= 2) {
    written_.resize(room);
    next_models_ = models_;
    NumberEncoder coder(written_);
    Wanted source{target, slots, record_bytes()};
    const bool good = code_section(coder, next_models_, lives, source);
    TANDEM_ASSERT(good && source.next == slots.size());
    const std::size_t size = coder.finish();
    if (coder.overflow()) continue;
    clear_marks(lives);
    is_coded_ = true;
    return std::span(written_).first(size);
  }
}

Result<void> BodyData::decode(std::span<const std::byte> section, const Lives& lives) {
  keep();
  mark_renewed(lives);
  next_models_ = models_;
  NumberDecoder coder(section);
  Found source{changes_, record_bytes()};
  const bool good = code_section(coder, next_models_, lives, source);
  clear_marks(lives);
  if (!good || changes_.slots.empty() || !coder.at_end()) {
    keep();
    return malformed("section of data that no server writes");
  }
  is_coded_ = true;
  return {};
}

void BodyData::keep() {
  changes_.slots.clear();
  changes_.records.clear();
  is_coded_ = false;
}

void BodyData::put(Slot slot, std::span<const std::byte> record) {
  std::copy(record.begin(), record.end(), at(slot));
  ages_[slot] = 0;
  Block& block = blocks_[slot / kBlockSlots];
  block.quiet = 0;
  block.records_changed = block.ages_changed = true;
}

void BodyData::grow_older(std::uint32_t index, std::span<const std::uint8_t> alive) {
  Block& block = blocks_[index];
  if (block.quiet == kMaxAge) return;
  ++block.quiet;
  block.ages_changed = true;
  const Slot first = index * kBlockSlots, end = std::min(first + kBlockSlots, capacity());
  for (Slot slot = first; slot < end; ++slot) {
    const auto more = static_cast<std::uint8_t>(alive[slot] != 0 && ages_[slot] != kMaxAge ? 1 : 0);
    ages_[slot] = static_cast<std::uint8_t>(ages_[slot] + more);
  }
}

void BodyData::apply(const Lives& lives) {
  for (std::uint32_t block = 0; block < blocks_.size(); ++block) grow_older(block, lives.alive);
  for (const LifecycleRecord& record : lives.lifecycle) {
    if (record.kind == LifecycleKind::kSpawn || record.kind == LifecycleKind::kDespawn)
      put(record.slot, std::span(kNothing).first(record_bytes()));
  }
  const std::span<const std::byte> records = changes_.records;
  for (std::size_t i = 0; i < changes_.slots.size(); ++i)
    put(changes_.slots[i], records.subspan(i * record_bytes(), record_bytes()));
  if (is_coded_) models_ = next_models_;
  is_coded_ = false;
}

std::uint64_t BodyData::hash() {
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    Block& block = blocks_[i];
    const std::size_t first = i * kBlockSlots, slots = std::min<std::size_t>(kBlockSlots, capacity() - first);
    if (block.records_changed)
      leaves_[2 * i] =
          hash_bytes(std::span(records_).subspan(first * record_bytes(), slots * record_bytes()));
    if (block.ages_changed)
      leaves_[2 * i + 1] = hash_bytes(std::as_bytes(std::span(ages_).subspan(first, slots)));
    block.records_changed = block.ages_changed = false;
  }
  return hash_bytes(std::as_bytes(std::span(leaves_)));
}

std::size_t BodyData::bytes_bound() const {
  const std::size_t numbers = shape_.numbers().size();
  std::size_t bits = 2 + 2 * shape_.fields() + most_number_bits(kMaxAge);
  for (const DataNumber& number : shape_.numbers())
    bits += 2 + most_number_bits(1U << (8U * number.bytes - 1));
  std::size_t models = 0;
  for_each_model(models_, numbers, [&](const LearningModel&) { ++models; });
  constexpr std::size_t kModelBits = 7 + 16, kFixedBytes = 256;
  return kFixedBytes + (std::size_t{capacity()} * bits + models * kModelBits) / 8;
}

// Codes what a snapshot has: each number and the ages as steps from those of the living body before, then the
// models. Returns false if a decoder read what no encoder writes.
template <class Coder, class Records, class Ages>
bool BodyData::code_all(Coder& coder, const DataShape& shape, std::span<const std::uint8_t> alive,
                        Records records, Ages ages, DataModels& models) {
  constexpr bool kReads = !std::is_const_v<typename Records::element_type>;
  for (const DataNumber& number : shape.numbers()) {
    NumberModels kind;
    std::uint32_t before = 0;
    for (Slot slot = 0; slot < alive.size(); ++slot) {
      if (alive[slot] == 0) continue;
      auto* const record = records.data() + slot * shape.record_bytes();
      const std::int64_t step = code_number(coder, kind, number.step(before, number.value_in(record)));
      if (!number.is_step(step)) return false;
      before = number.stepped(before, step);
      if constexpr (kReads) number.put(before, record);
    }
  }
  NumberModels kind;
  std::int64_t before = 0;
  for (Slot slot = 0; slot < alive.size(); ++slot) {
    if (alive[slot] == 0) continue;
    before += code_number(coder, kind, ages[slot] - before);
    if (before < 0 || before > kMaxAge) return false;
    if constexpr (kReads) ages[slot] = static_cast<std::uint8_t>(before);
  }
  bool good = true;
  for_each_model(models, shape.numbers().size(), [&](LearningModel& model) {
    constexpr unsigned kSeenBits = 7, kProbabilityBits = 16;
    model.seen = static_cast<std::uint8_t>(coder.even(model.seen, kSeenBits));
    if (model.seen != 1) model.p1 = static_cast<std::uint16_t>(coder.even(model.p1, kProbabilityBits));
    good &= model.seen != 0 && model.p1 != 0;
  });
  return good;
}

void BodyData::write(std::span<const std::uint8_t> alive, ByteWriter& out) const {
  DataModels models = models_;
  NumberEncoder coder(out.rest());
  const bool good = code_all(coder, shape_, alive, std::span<const std::byte>(records_),
                             std::span<const std::uint8_t>(ages_), models);
  TANDEM_ASSERT(good);
  const std::size_t size = coder.finish();
  TANDEM_ASSERT(!coder.overflow());  // there is room for bytes_bound()
  out.advance(size);
}

Result<void> BodyData::read(std::span<const std::byte> section, std::span<const std::uint8_t> alive) {
  TANDEM_ASSERT(alive.size() == ages_.size());
  std::fill(records_.begin(), records_.end(), std::byte{0});
  std::fill(ages_.begin(), ages_.end(), std::uint8_t{0});
  std::fill(blocks_.begin(), blocks_.end(), Block{});
  models_ = {};
  keep();
  NumberDecoder coder(section);
  if (!code_all(coder, shape_, alive, std::span<std::byte>(records_), std::span<std::uint8_t>(ages_),
                models_) ||
      !coder.at_end())
    return malformed("data of a snapshot that no server writes");
  return {};
}

}  // namespace tandem
