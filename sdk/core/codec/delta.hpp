#pragma once
// A delta's payload consists of typed sections: lifecycle records first, then parameters in force, rounding,
// corrections.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/rounding.hpp"
#include "sdk/core/layout/sections.hpp"

namespace tandem {

enum class LifecycleKind : std::uint8_t { kDespawn = 0, kSpawn = 1, kTeleport = 2, kTypeChange = 3 };

/// One explicit change of a slot. The records of a delta ascend by slot. A slot may have two records only for
/// a reuse within a frame: despawn, then spawn.
struct LifecycleRecord {
  LifecycleKind kind = LifecycleKind::kDespawn;
  Slot slot = 0;
  std::uint8_t reuse = 0;                ///< spawn only
  TypeId type = 0;                       ///< spawn and type change
  BodyState body;                        ///< spawn; for a teleport the groups in `groups`
  std::uint8_t groups = kMovesPosition;  ///< teleport only: at least one of the stream's
};

/// The content of a payload. Spans are valid until the next encode() or decode() of the codec that read it.
struct Delta {
  std::span<const LifecycleRecord> lifecycle;
  StreamParameters parameters;  ///< in force from this delta on
  std::optional<Rounding> rounding;
  Corrections corrections;
};

/// Encodes and decodes whole payloads with a codec. There is one per side and session. Not thread-safe.
/// encode() and decode() allocate only on the first call, for the first lifecycle records or rounding, for
/// more records than ever before, and for the message of a refusal.
class DeltaCodec {
 public:
  /// `codec` must be made for `capacity`. `radii`: those of the stream, with orientations.
  DeltaCodec(std::unique_ptr<Codec> codec, std::uint32_t capacity, const StreamParameters& parameters,
             TypeId type_count, const Groups& groups = {}, std::span<const std::int32_t> radii = {});
  DeltaCodec(DeltaCodec&&) noexcept;
  DeltaCodec& operator=(DeltaCodec&&) noexcept;
  DeltaCodec(const DeltaCodec&) = delete;
  DeltaCodec& operator=(const DeltaCodec&) = delete;
  ~DeltaCodec();

  /// Maximum number of bytes that encode() writes: lifecycle of every slot, parameters and the codec's bound.
  [[nodiscard]] std::size_t bound() const;
  /// The same for a delta with so many records.
  [[nodiscard]] std::size_t bound(std::size_t records) const;

  struct Encoded {
    std::size_t size_bytes = 0;        ///< size of the payload
    std::size_t correction_bytes = 0;  ///< size of the correction sections, including headers
    std::uint32_t corrected = 0;       ///< number of corrected bodies
  };
  /// Server side: applies `lifecycle`, rounding and corrections to `state` (predicted) and writes them to
  /// `out`, which holds at least bound(lifecycle.size()) bytes. `target` is the full simulation on the
  /// lattice. Writes at most `budget` bytes, unless lifecycle and parameters alone take more. Preconditions
  /// are asserted.
  Encoded encode(State& state, const State& target, std::span<const LifecycleRecord> lifecycle,
                 std::size_t budget, std::span<std::byte> out, EncodeObserver* observer = nullptr,
                 const KnownBlocks& known = {});

  /// Server side: sets the parameters from the next encode() on; they are sent in that delta.
  void set_parameters(const StreamParameters& parameters);
  [[nodiscard]] const StreamParameters& parameters() const;
  /// Server side: the next encode() also rounds every body, as far as its threshold permits. Encoded bodies
  /// still keep to the threshold.
  void round_next();
  /// Sets the gravity of the drive in force at the frame that is encoded or decoded next, 1/64 unit per
  /// frame^2. It stays until the next call. Zero at first.
  void set_gravity(const Vec3i& gravity);
  /// Client side: sets the parameters in force from a snapshot; sends nothing.
  void restore_parameters(const StreamParameters& parameters);

  /// Client side: validates all of `payload`, the delta of the frame that is `predicted`. Changes nothing.
  /// Errors: kMalformed, kUnsupported (unknown critical section).
  [[nodiscard]] Result<Delta> decode(const State& predicted, std::span<const std::byte> payload,
                                     const KnownBlocks& known = {});
  /// Client side: applies the result of the last decode() to the state that decode() read.
  void apply(const Delta& delta, State& state);

  /// Results of the last encode() or apply(), empty after a decode(). touched(): the slots that records or
  /// corrections named, or all if it rounded; each once, ascending. lifecycle(): the records.
  [[nodiscard]] std::span<const Slot> touched() const;
  /// The slots that corrections named.
  [[nodiscard]] std::span<const Slot> corrected() const;
  [[nodiscard]] std::span<const LifecycleRecord> lifecycle() const;
  [[nodiscard]] Codec& codec();
  [[nodiscard]] const Codec& codec() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem
