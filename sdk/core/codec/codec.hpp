#pragma once
// The codec interface: what turns the difference between a predicted and a target state into bytes.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/state.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// What a decoder reads besides its bytes. May change between frames; a change travels in the delta itself.
struct CodecParameters {
  std::int32_t threshold = 0;      ///< lattice units; bodies further off than this are corrected. > 0
  std::int32_t position_step = 1;  ///< lattice units per quantisation step (range / 127). > 0
  std::int32_t velocity_step = 1;  ///< 1/64 unit per frame per quantisation step (range / 127). > 0
  friend bool operator==(const CodecParameters&, const CodecParameters&) = default;
};

/// Budget that never binds.
inline constexpr std::size_t kNoBudget = SIZE_MAX;

/// The corrections part of a delta: one implementation a codec name (paper, sections 3.3.1 and 3.3.2).
///
/// encode() and parse()+apply() leave the same state on both sides. Both see the state after the delta's lifecycle
/// records. Nothing here allocates after construction. Not thread-safe.
class Codec {
 public:
  virtual ~Codec() = default;
  [[nodiscard]] virtual std::string_view name() const = 0;
  /// Most bytes encode() can write for this session's capacity.
  [[nodiscard]] virtual std::size_t bound() const = 0;

  /// Writes correction sections that move `state` (predicted) towards `target`, and moves it.
  /// `target` has the same alive slots. Never writes more than `budget` bytes, section headers included;
  /// where the budget binds, the largest errors go first. Returns the number of corrected bodies.
  virtual std::uint32_t encode(State& state, const State& target, const CodecParameters& parameters,
                               std::size_t budget, ByteWriter& out) = 0;

  /// Forgets what parse() collected. Call before the first section of a delta.
  virtual void begin() = 0;
  /// Validates the body of one corrections section against `alive` (the alive column after lifecycle) and collects
  /// its corrections; changes no state. Errors: kMalformed with the reason.
  virtual Result<void> parse(std::span<const std::byte> section, std::span<const std::uint8_t> alive,
                             const CodecParameters& parameters) = 0;
  /// Applies all collected corrections. Only after every section of the delta parsed.
  virtual void apply(State& state) = 0;
  /// Slots corrected by the last encode() or apply(), each once.
  [[nodiscard]] virtual std::span<const Slot> corrected() const = 0;

  /// The codec's own per-body bytes, part of the state hash and of snapshots. Empty for the paper's codecs.
  [[nodiscard]] virtual std::span<const std::byte> body_state() const { return {}; }
  /// Coder state that lives across frames, as it goes into a snapshot. Nothing for the paper's codecs.
  virtual void save(ByteWriter& /*out*/) const {}
  [[nodiscard]] virtual Result<void> load(std::span<const std::byte> bytes) {
    if (!bytes.empty()) return fail(ErrorCode::kMalformed, "this codec keeps no coder state");
    return {};
  }
};

/// Makes the codec a session names. `tables` travel in the session (code lengths of `entropy` and `limited`, empty
/// for the others). Errors: kUnsupported for an unknown name, kMalformed for tables that do not fit it.
[[nodiscard]] Result<std::unique_ptr<Codec>> make_codec(std::string_view name, std::uint32_t capacity,
                                                        std::span<const std::byte> tables);

/// The names make_codec() knows, in the order of the paper's table 5.1.
[[nodiscard]] std::span<const std::string_view> codec_names();

/// `limited`: 0.05 Mbit per frame (paper, table 5.1), 2^20 bits to the Mbit.
inline constexpr std::size_t kPaperBudgetBytes = 6553;

}  // namespace tandem
