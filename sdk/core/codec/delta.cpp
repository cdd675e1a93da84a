#include "sdk/core/codec/delta.hpp"

#include <algorithm>
#include <functional>
#include <numeric>
#include <utility>

#include "sdk/core/codec/lifecycle.hpp"
#include "sdk/core/lattice/assert.hpp"

namespace tandem {
struct DeltaCodec::Impl {
  std::unique_ptr<Codec> codec;
  std::uint32_t capacity = 0;
  TypeId type_count = 0;
  Groups groups;
  std::int32_t most_radius = 0;  // lattice units; with orientations
  StreamParameters parameters;   // in force
  StreamParameters next;         // server: parameters from the next encode() on
  bool round_next = false;       // server: the next encode() rounds
  Vec3i gravity{};               // at the current delta
  // The lifecycle of the current delta.
  std::vector<LifecycleRecord> lifecycle;
  std::vector<std::uint8_t> alive;  // after lifecycle; made when the first records come
  std::vector<Slot> renewed;        // slots whose body a lifecycle record started or ended
  std::vector<Section> sections;
  // The records of the last delta that was applied.
  std::span<const LifecycleRecord> applied;
  // Touched slots, if lifecycle or rounding adds to the corrected ones; made when that happens first.
  std::vector<Slot> merged;
  std::span<const Slot> touched, corrected;

  struct Parsed {
    int stage = 0;  // order of the section among the others: lifecycle, parameters, rounding, corrections
    StreamParameters parameters;
    std::optional<Rounding> rounding;
    std::span<const std::uint8_t> alive;
  };
  Result<void> parse(std::span<const std::byte> payload, const State& predicted, Parsed& parsed);
  Result<void> parse_section(std::uint8_t type, std::span<const std::byte> body, const State& predicted,
                             Parsed& parsed);
  void list_renewed();
  void remember(const Delta& delta);
};

void DeltaCodec::Impl::list_renewed() {
  renewed.clear();
  for (const LifecycleRecord& record : lifecycle) {
    if (record.kind == LifecycleKind::kTypeChange) continue;
    if (renewed.empty() || renewed.back() != record.slot) renewed.push_back(record.slot);
  }
}

Result<void> DeltaCodec::Impl::parse_section(std::uint8_t type, std::span<const std::byte> body,
                                             const State& predicted, Parsed& parsed) {
  const auto enter = [&parsed](int stage) {
    // Corrections may repeat (one section per block), the others may not.
    if (stage < parsed.stage || (stage == parsed.stage && stage != 4)) return false;
    parsed.stage = stage;
    return true;
  };
  switch (static_cast<SectionType>(type)) {
    case SectionType::kLifecycle: {
      if (!enter(1)) break;
      if (auto read = read_lifecycle(body, groups, lifecycle); !read) return read;
      alive.assign(predicted.alive().begin(), predicted.alive().end());
      if (const char* reason = check_lifecycle(lifecycle, alive, type_count)) {
        return fail(ErrorCode::kMalformed, reason);
      }
      parsed.alive = alive;
      return {};
    }
    case SectionType::kParameters: {
      if (!enter(2)) break;
      const auto named = read_parameters(body, parsed.parameters);
      if (!named) return tl::unexpected<Error>(named.error());
      if (*named == 0) return fail(ErrorCode::kMalformed, "parameters section that names none");
      if (!list_the_same(parsed.parameters, parameters))
        return fail(ErrorCode::kMalformed, "parameter that the stream does not list");
      return {};
    }
    case SectionType::kRounding: {
      if (!enter(3)) break;
      const auto rounding = read_rounding(body, groups);
      if (!rounding) return tl::unexpected<Error>(rounding.error());
      parsed.rounding = *rounding;
      return {};
    }
    case SectionType::kCorrections:
    case SectionType::kLastCorrections: {
      if (!enter(4)) break;
      ByteReader in(body);
      Section section{block_count(capacity) - 1, {}};
      if (static_cast<SectionType>(type) == SectionType::kCorrections)
        section.block = static_cast<std::uint32_t>(in.get_leb128(kMaxBlockNumberBytes));
      section.body = in.get_bytes(in.remaining());
      if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated corrections section");
      if (section.block >= block_count(capacity))
        return fail(ErrorCode::kMalformed, "corrections of a block beyond the capacity");
      if (!sections.empty() && section.block <= sections.back().block)
        return fail(ErrorCode::kMalformed, "blocks do not ascend");
      sections.push_back(section);
      return {};
    }
    default:
      return skip_section(type);
  }
  return fail(ErrorCode::kMalformed, "sections out of order or repeated");
}

void DeltaCodec::Impl::remember(const Delta& delta) {
  applied = delta.lifecycle;
  touched = corrected = delta.corrections.slots;
  TANDEM_ASSERT(std::adjacent_find(corrected.begin(), corrected.end(), std::greater_equal<>()) ==
                corrected.end());
  if (delta.rounding) {
    merged.resize(capacity);
    std::iota(merged.begin(), merged.end(), 0U);
    touched = merged;
    return;
  }
  if (applied.empty()) return;
  merged.reserve(capacity);
  merged.clear();
  auto rest = corrected.begin();
  for (const LifecycleRecord& record : applied) {
    if (!merged.empty() && merged.back() == record.slot) continue;
    while (rest != corrected.end() && *rest < record.slot) merged.push_back(*rest++);
    if (rest != corrected.end() && *rest == record.slot) ++rest;
    merged.push_back(record.slot);
  }
  merged.insert(merged.end(), rest, corrected.end());
  touched = merged;
  TANDEM_ASSERT(touched.size() <= capacity && touched.back() < capacity);
}

DeltaCodec::DeltaCodec(std::unique_ptr<Codec> codec, std::uint32_t capacity,
                       const StreamParameters& parameters, TypeId type_count, const Groups& groups,
                       std::span<const std::int32_t> radii)
    : impl_(std::make_unique<Impl>()) {
  TANDEM_ASSERT(valid_parameters(parameters.codec));
  TANDEM_ASSERT(codec != nullptr);
  impl_->codec = std::move(codec);
  impl_->capacity = capacity;
  impl_->type_count = type_count;
  impl_->groups = groups;
  for (const std::int32_t radius : radii) impl_->most_radius = std::max(impl_->most_radius, radius);
  impl_->parameters = parameters;
  impl_->next = parameters;
  impl_->lifecycle.reserve(std::min<std::size_t>(capacity, 1024));
  impl_->renewed.reserve(std::min<std::size_t>(capacity, 1024));
  impl_->sections.reserve(block_count(capacity));
}
DeltaCodec::DeltaCodec(DeltaCodec&&) noexcept = default;
DeltaCodec& DeltaCodec::operator=(DeltaCodec&&) noexcept = default;
DeltaCodec::~DeltaCodec() = default;

std::size_t DeltaCodec::bound() const { return bound(impl_->capacity); }

std::size_t DeltaCodec::bound(std::size_t records) const {
  const std::size_t slots = std::min<std::size_t>(records, impl_->capacity);
  return 3 * kMaxSectionHeaderBytes + slots * most_lifecycle_bytes_per_slot(impl_->groups) +
         kMaxParametersBytes + kMaxRoundingBytes + impl_->codec->bound();
}

DeltaCodec::Encoded DeltaCodec::encode(State& state, const State& target,
                                       std::span<const LifecycleRecord> lifecycle, std::size_t budget,
                                       std::span<std::byte> out, EncodeObserver* observer,
                                       const KnownBlocks& known) {
  TANDEM_ASSERT(out.size() >= bound(lifecycle.size()));
  TANDEM_ASSERT(state.capacity() == impl_->capacity && target.capacity() == impl_->capacity);
  ByteWriter writer(out);
  impl_->lifecycle.assign(lifecycle.begin(), lifecycle.end());
  if (!lifecycle.empty()) {
#ifdef TANDEM_ASSERTIONS
    impl_->alive.assign(state.alive().begin(), state.alive().end());
    TANDEM_ASSERT(check_lifecycle(lifecycle, impl_->alive, impl_->type_count) == nullptr);
#endif
    put_section(SectionType::kLifecycle, writer,
                [&](ByteWriter& body) { write_lifecycle(lifecycle, impl_->groups, body); });
    apply_lifecycle(lifecycle, state);
  }
  if (impl_->next != impl_->parameters) {
    put_section(SectionType::kParameters, writer,
                [&](ByteWriter& body) { write_parameters(impl_->next, &impl_->parameters, body); });
    impl_->parameters = impl_->next;
  }
  std::optional<Rounding> rounding;
  if (std::exchange(impl_->round_next, false)) {
    rounding = rounding_for(impl_->parameters.codec.threshold, impl_->most_radius);
    put_section(SectionType::kRounding, writer,
                [&](ByteWriter& body) { write_rounding(*rounding, impl_->groups, body); });
    round_before_corrections(*rounding, state);
  }
  TANDEM_ASSERT(std::equal(state.alive().begin(), state.alive().end(), target.alive().begin()));
  if (observer != nullptr) observer->frame(state, target, impl_->parameters.codec);
  Encoded encoded;
  const std::size_t before = writer.size();
  const std::size_t left = budget - std::min(budget, before);
  impl_->list_renewed();
  const Corrections corrections =
      impl_->codec->encode({state, state.alive(), impl_->renewed, impl_->parameters.codec, impl_->gravity,
                            rounding.value_or(Rounding{}), rounding ? KnownBlocks{} : known},
                           target, left, writer, observer);
  TANDEM_ASSERT(!writer.overflow() && writer.size() - before <= left);
  encoded.size_bytes = writer.size();
  encoded.correction_bytes = writer.size() - before;
  encoded.corrected = static_cast<std::uint32_t>(corrections.slots.size());
  impl_->codec->apply(corrections, state);
  if (rounding) round_after_corrections(*rounding, state);
  impl_->remember({impl_->lifecycle, impl_->parameters, rounding, corrections});
  return encoded;
}

void DeltaCodec::set_parameters(const StreamParameters& parameters) {
  TANDEM_ASSERT(valid_parameters(parameters.codec) && list_the_same(parameters, impl_->parameters));
  impl_->next = parameters;
}
void DeltaCodec::set_gravity(const Vec3i& gravity) { impl_->gravity = gravity; }
void DeltaCodec::round_next() { impl_->round_next = true; }
const StreamParameters& DeltaCodec::parameters() const { return impl_->parameters; }
void DeltaCodec::restore_parameters(const StreamParameters& parameters) {
  set_parameters(parameters);
  impl_->parameters = parameters;
}

Result<void> DeltaCodec::Impl::parse(std::span<const std::byte> payload, const State& predicted,
                                     Parsed& parsed) {
  ByteReader in(payload);
  while (in.remaining() > 0) {
    const auto section = next_section(in);
    if (!section) return tl::unexpected<Error>(section.error());
    if (auto good = parse_section(section->type, section->body, predicted, parsed); !good) return good;
  }
  return {};
}

Result<Delta> DeltaCodec::decode(const State& predicted, std::span<const std::byte> payload,
                                 const KnownBlocks& known) {
  TANDEM_ASSERT(predicted.capacity() == impl_->capacity);
  impl_->lifecycle.clear();
  impl_->sections.clear();
  impl_->remember({});
  Impl::Parsed parsed{0, impl_->parameters, std::nullopt, predicted.alive()};
  if (auto result = impl_->parse(payload, predicted, parsed); !result)
    return tl::unexpected<Error>(result.error());
  impl_->list_renewed();
  const auto corrections =
      impl_->codec->decode({predicted, parsed.alive, impl_->renewed, parsed.parameters.codec, impl_->gravity,
                            parsed.rounding.value_or(Rounding{}), parsed.rounding ? KnownBlocks{} : known},
                           impl_->sections);
  if (!corrections) return tl::unexpected<Error>(corrections.error());
  return Delta{impl_->lifecycle, parsed.parameters, parsed.rounding, *corrections};
}

void DeltaCodec::apply(const Delta& delta, State& state) {
  TANDEM_ASSERT(state.capacity() == impl_->capacity);
  impl_->parameters = impl_->next = delta.parameters;
  apply_lifecycle(delta.lifecycle, state);
  if (delta.rounding) round_before_corrections(*delta.rounding, state);
  impl_->codec->apply(delta.corrections, state);
  if (delta.rounding) round_after_corrections(*delta.rounding, state);
  impl_->remember(delta);
}

std::span<const Slot> DeltaCodec::touched() const { return impl_->touched; }
std::span<const Slot> DeltaCodec::corrected() const { return impl_->corrected; }
std::span<const LifecycleRecord> DeltaCodec::lifecycle() const { return impl_->applied; }
Codec& DeltaCodec::codec() { return *impl_->codec; }
const Codec& DeltaCodec::codec() const { return *impl_->codec; }

}  // namespace tandem
