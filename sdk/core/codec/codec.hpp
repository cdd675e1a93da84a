#pragma once
// The codec interface: turns the difference between a predicted and a target state into bytes.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "sdk/core/codec/numbers.hpp"
#include "sdk/core/codec/observer.hpp"
#include "sdk/core/codec/rounding.hpp"
#include "sdk/core/lattice/block_ledger.hpp"
#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/run_blocks.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/parameters.hpp"
#include "sdk/core/layout/tracker_kind.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// A budget that is never reached.
inline constexpr std::size_t kNoBudget = SIZE_MAX;

/// Block numbers of both states of a frame before its corrections. All calls must use numbers of one owner.
/// The bytes are the same without them.
struct KnownBlocks {
  BlockNumbers predicted;  ///< before the delta's lifecycle records: nothing about blocks with renewed slots
  BlockNumbers target;     ///< encoder only
};

/// The input of a codec: a frame before its corrections.
struct CodecFrame {
  /// The predicted state. An encoder's has the delta's lifecycle records applied; a decoder's does not, so
  /// bodies of `renewed` must not be read from it.
  const State& predicted;
  std::span<const std::uint8_t> alive;  ///< the column after the records
  std::span<const Slot> renewed;        ///< slots spawned, despawned or teleported by the records; ascending,
                                        ///< each once
  const CodecParameters& parameters;
  Vec3i gravity{};      ///< gravity of the drive in force at this frame; c of a body at rest balances it
  Rounding rounding{};  ///< of this delta, none by default: p and q are rounded in an encoder's state;
                        ///< `tracker` keeps p rounded, and q is rounded once more afterwards
  KnownBlocks known{};  ///< empty if the delta rounds
};

/// One corrections section: the number of an existing block, and the codec's bytes for it.
struct Section {
  std::uint32_t block = 0;
  std::span<const std::byte> body;
};

/// The bodies that a delta corrects. The codec stores by how much, and what the spans show, until its next
/// encode() or decode().
struct Corrections {
  std::span<const Slot> slots;    ///< each once, ascending
  std::span<const Slot> renewed;  ///< as in the frame
  CodecParameters parameters;     ///< as in the frame
  Vec3i gravity{};                ///< as in the frame
  Rounding rounding{};            ///< as in the frame
};

/// The corrections part of a delta; one implementation for each codec name (thesis, sections 3.3.1 and
/// 3.3.2).
///
/// The server encodes and applies, a client decodes and applies; both end with the same state. Memory is
/// allocated only by the first encode() (a decoder does not need the encoder's memory), by the first that a
/// budget limits, for a longer stream of a block than ever before, and for the message of
/// a refusal. Not thread-safe.
class Codec {
 public:
  virtual ~Codec() = default;
  [[nodiscard]] virtual std::string_view name() const = 0;
  /// Maximum number of bytes that encode() can write for this session's capacity.
  [[nodiscard]] virtual std::size_t bound() const = 0;

  /// Writes sections that move the predicted state towards `target`, which has the same alive slots. Does not
  /// change a state yet. Writes at most `budget` bytes, including section headers, and never beyond the end
  /// of `out`. If that does not suffice, the bodies with the largest errors go first, ties by slot, up to the
  /// first body that does not fit (`tracker`: see tracker.hpp). `observer` may be null.
  virtual Corrections encode(const CodecFrame& frame, const State& target, std::size_t budget,
                             ByteWriter& out, EncodeObserver* observer) = 0;

  /// Validates all corrections sections of a delta; their blocks must ascend. Does not change a state yet.
  /// Errors: kMalformed with the reason.
  virtual Result<Corrections> decode(const CodecFrame& frame, std::span<const Section> sections) = 0;

  /// Applies the result of the last encode() or decode() to the frame's state, which has the lifecycle
  /// records applied. Call it once a frame, even without corrections, because codecs that learn do so here.
  virtual void apply(const Corrections& corrections, State& state) = 0;

  /// The codec's own columns, which are part of the state hash and of snapshots: one byte per slot, one
  /// column after another; zero for dead slots. Empty for the thesis's codecs.
  [[nodiscard]] virtual std::span<const std::byte> columns() const { return {}; }
  /// The numbers of the columns' contents. Empty: unknown.
  [[nodiscard]] virtual BlockNumbers column_numbers() const { return {}; }
  /// How a snapshot guesses the numbers of one of these columns.
  [[nodiscard]] virtual Guess guess(std::size_t /*column*/) const { return Guess::kZero; }
  /// Writes the codec's other state that lives across frames into a snapshot. Nothing for the thesis's
  /// codecs.
  virtual void save_models(NumberEncoder& /*out*/) const {}
  /// Maximum number of bits that save_models() writes.
  [[nodiscard]] virtual std::size_t models_bits_bound() const { return 0; }
  /// Loads the state of a snapshot. `columns`: as many bytes as columns() has, zero for dead slots. `models`:
  /// exactly what save_models() wrote. Errors: kMalformed for bytes that this codec would not have written;
  /// then nothing changed.
  [[nodiscard]] virtual Result<void> load(std::span<const std::byte> /*columns*/, NumberDecoder& models) {
    if (!models.at_end()) return fail(ErrorCode::kMalformed, "coder state of wrong length");
    return {};
  }
};

/// Everything that a codec needs to know. Only its constructor reads the views.
struct CodecSetup {
  std::string_view name;
  std::uint32_t capacity = 0;                ///< 1 .. kMaxCapacity
  std::span<const std::byte> tables = {};    ///< the session's tables; empty without takes_tables
  TrackerKind tracker = {};                  ///< of the session's predictor
  Groups groups = {};                        ///< of the stream's states
  std::span<const std::int32_t> radii = {};  ///< lattice units, by type; with orientations
  RunBlocks run_blocks = {};  ///< how to code blocks in parallel, if the codec can; empty: one after the
                              ///< other
};

}  // namespace tandem
