#pragma once
// The codec interface: what turns the difference between a predicted and a target state into bytes.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "sdk/core/codec/numbers.hpp"
#include "sdk/core/codec/observer.hpp"
#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/run_blocks.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/parameters.hpp"
#include "sdk/core/layout/tracker_kind.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// Budget that never binds.
inline constexpr std::size_t kNoBudget = SIZE_MAX;

/// A frame before its corrections, as a codec sees it.
struct CodecFrame {
  /// An encoder's has the delta's lifecycle records applied; a decoder's does not, so that bodies of
  /// `renewed` must not be read from it.
  const State& predicted;
  std::span<const std::uint8_t> alive;  ///< the column after the records
  std::span<const Slot> renewed;        ///< spawned, despawned or teleported by them; ascending, each once
  const CodecParameters& parameters;
  Vec3i gravity{};             ///< of the drive in force at this frame: what c of a body at rest holds up
  unsigned position_bits = 0;  ///< rounded to multiples of 2^n: an encoder's p are, and `tracker` keeps it so
};

/// One corrections section: a block that exists, and what the codec says of it.
struct Section {
  std::uint32_t block = 0;
  std::span<const std::byte> body;
};

/// Which bodies a delta corrects; by how much stands in the codec until its next encode() or decode(), and so
/// do the spans.
struct Corrections {
  std::span<const Slot> slots;    ///< each once, ascending
  std::span<const Slot> renewed;  ///< as in the frame
  CodecParameters parameters;     ///< as in the frame
  Vec3i gravity{};                ///< as in the frame
  unsigned position_bits = 0;     ///< as in the frame
};

/// The corrections part of a delta: one implementation a codec name (paper, sections 3.3.1 and 3.3.2).
///
/// The server encodes and applies, a client decodes and applies; both end with the same state. Only the first
/// encode() allocates (a decoder needs no encoder's memory), and the message of a refusal. Not thread-safe.
class Codec {
 public:
  virtual ~Codec() = default;
  [[nodiscard]] virtual std::string_view name() const = 0;
  /// Most bytes encode() can write for this session's capacity.
  [[nodiscard]] virtual std::size_t bound() const = 0;

  /// Writes sections that move the predicted state towards `target`, which has the same alive slots; changes
  /// no state yet. Never writes more than `budget` bytes, section headers included, nor beyond the end of
  /// `out`; where that binds, the largest errors go first, ties by slot, up to the first body that does not
  /// fit (`tracker`: see tracker.hpp). `observer` may be null.
  virtual Corrections encode(const CodecFrame& frame, const State& target, std::size_t budget,
                             ByteWriter& out, EncodeObserver* observer) = 0;

  /// Validates all corrections sections of a delta, whose blocks ascend; changes no state yet. Errors:
  /// kMalformed with the reason.
  virtual Result<Corrections> decode(const CodecFrame& frame, std::span<const Section> sections) = 0;

  /// Does what the last encode() or decode() returned to the frame's state, lifecycle records applied. Once a
  /// frame, also where nothing is corrected: codecs that learn learn here.
  virtual void apply(const Corrections& corrections, State& state) = 0;

  /// The codec's own columns, part of the state hash and of snapshots: one byte a slot, one column after
  /// another; zero for dead slots. Empty for the paper's codecs.
  [[nodiscard]] virtual std::span<const std::byte> columns() const { return {}; }
  /// What else lives across frames, as it goes into a snapshot. Nothing for the paper's codecs.
  virtual void save_models(NumberEncoder& /*out*/) const {}
  /// Most bits that save_models() writes.
  [[nodiscard]] virtual std::size_t models_bits_bound() const { return 0; }
  /// `columns`: as many as columns() has, zero for dead slots. `models`: what save_models() wrote, and
  /// nothing behind it. Errors: kMalformed for what this codec would not have written; then nothing changed.
  [[nodiscard]] virtual Result<void> load(std::span<const std::byte> /*columns*/, NumberDecoder& models) {
    if (!models.at_end()) return fail(ErrorCode::kMalformed, "coder state of wrong length");
    return {};
  }
};

/// All that a codec needs to know. Views are read by its constructor alone.
struct CodecSetup {
  std::string_view name;
  std::uint32_t capacity = 0;                ///< 1 .. kMaxCapacity
  std::span<const std::byte> tables = {};    ///< as the session has them; empty without takes_tables
  TrackerKind tracker = {};                  ///< of the session's predictor
  Groups groups = {};                        ///< of the stream's states
  std::span<const std::int32_t> radii = {};  ///< lattice units, by type; with orientations
  RunBlocks run_blocks = {};  ///< how to code blocks side by side, where a codec can; empty: one by one
};

}  // namespace tandem
