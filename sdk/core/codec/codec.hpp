#pragma once
// The codec interface: what turns the difference between a predicted and a target state into bytes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/parameters.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// Budget that never binds.
inline constexpr std::size_t kNoBudget = SIZE_MAX;

/// Adaptive codecs' own books: what their decisions took, and what they would have taken at best.
struct CodeAccount {
  double ideal_bits = 0;  ///< sum of -log2 of the probability that each decision had
  std::vector<std::array<std::uint64_t, 2>> decisions;  ///< zeros and ones by context
};

/// What corrections say of a filter's gains: sums of cosines. Positive: more of it is wanted.
struct GainEvidence {
  double agreement = 0;        ///< of corrections with the one before: of v
  std::uint64_t repeated = 0;  ///< corrections in it
  double forwardness = 0;      ///< of corrections with c: of what is kept of c
  std::uint64_t driven = 0;    ///< corrections in it
  void add(const GainEvidence& more);
};

/// Calls job(0) .. job(count - 1), in any order and on any threads, and returns when all are done. Changes no
/// byte.
using RunBlocks = std::function<void(std::uint32_t count, const std::function<void(std::uint32_t)>& job)>;

/// The corrections part of a delta: one implementation a codec name (paper, sections 3.3.1 and 3.3.2).
///
/// encode() and parse()+apply() leave the same state on both sides. Both see the state after the delta's
/// lifecycle records. Only the first encode() allocates (a decoder needs no encoder's memory). Not
/// thread-safe.
class Codec {
 public:
  virtual ~Codec() = default;
  [[nodiscard]] virtual std::string_view name() const = 0;
  /// Most bytes encode() can write for this session's capacity.
  [[nodiscard]] virtual std::size_t bound() const = 0;

  /// Adds every encoded frame to `account`, which stays until this is called again; null: to none. For codecs
  /// with adaptive contexts; others do nothing.
  virtual void account_to(CodeAccount* /*account*/) {}

  /// Adds every encoded frame to `evidence`, which stays until this is called again; null: to none. For
  /// codecs with gains; others do nothing.
  virtual void evidence_to(GainEvidence* /*evidence*/) {}

  /// The frame to come: `predicted` stays valid until the end of encode() or apply(); `slots` (ascending,
  /// each once) are those that lifecycle records spawned, despawned or teleported in it. Comes before
  /// encode() and before the first parse(); a decoder's `predicted` does not have the records applied yet, so
  /// that bodies of `slots` must not be read from it. Changes no state. For codecs that remember bodies.
  virtual void renew(const State& /*predicted*/, std::span<const Slot> /*slots*/) {}

  /// Writes correction sections that move `state` (predicted) towards `target`, and moves it.
  /// `target` has the same alive slots. Never writes more than `budget` bytes, section headers included, nor
  /// beyond the end of `out`; where that binds, the largest errors go first, ties by slot, up to the first
  /// body that does not fit (`tracker`: see tracker.hpp). Any codec obeys a budget; by name, only `limited`
  /// is meant to have one. Returns the number of corrected bodies.
  virtual std::uint32_t encode(State& state, const State& target, const CodecParameters& parameters,
                               std::size_t budget, ByteWriter& out) = 0;

  /// Forgets what parse() collected. Call before the first section of a delta.
  virtual void begin() = 0;
  /// Validates the body of one corrections section against `alive` (the alive column after lifecycle) and
  /// collects its corrections; changes no state. Blocks ascend. `section` must stay until apply(). Errors:
  /// kMalformed with the reason.
  virtual Result<void> parse(std::span<const std::byte> section, std::span<const std::uint8_t> alive,
                             const CodecParameters& parameters) = 0;
  /// After the last section, if all parsed: refuses what can be seen only now. Changes no state. Errors:
  /// kMalformed with the reason.
  virtual Result<void> parse_end() { return {}; }
  /// Applies all collected corrections. Only after every section of the delta parsed, and parse_end().
  virtual void apply(State& state) = 0;
  /// Slots corrected by the last encode() or apply(), each once, ascending.
  [[nodiscard]] virtual std::span<const Slot> corrected() const = 0;

  /// The codec's own per-body bytes, part of the state hash and of snapshots. Empty for the paper's codecs.
  [[nodiscard]] virtual std::span<const std::byte> body_state() const { return {}; }
  /// Coder state that lives across frames, as it goes into a snapshot. Nothing for the paper's codecs.
  virtual void save(ByteWriter& /*out*/) const {}
  /// Most bytes save() writes.
  [[nodiscard]] virtual std::size_t save_bound() const { return 0; }
  /// Errors: kMalformed for what save() would not write beside these slots; then nothing changed.
  [[nodiscard]] virtual Result<void> load(std::span<const std::byte> bytes,
                                          std::span<const std::uint8_t> /*alive*/) {
    if (!bytes.empty()) return fail(ErrorCode::kMalformed, "this codec keeps no coder state");
    return {};
  }
};

/// `limited`: 0.05 Mbit per frame (paper, table 5.1), 2^20 bits to the Mbit.
inline constexpr std::size_t kPaperBudgetBytes = 6553;

/// What a codec is like, for those who choose, configure or compare codecs.
struct CodecTraits {
  bool is_baseline = false;      ///< of the paper: compared as the paper has it, with its predicted step
  bool reads_threshold = false;  ///< the others send every body
  bool reads_steps = false;      ///< quantisation steps
  bool reads_gains = false;      ///< and the decay that goes with them
  bool takes_tables = false;     ///< 512 code lengths (training.hpp makes them, trained or default)
  bool takes_budget = false;     ///< is meant to have one; any codec obeys it
  std::size_t usual_budget = kNoBudget;  ///< bytes a frame
};
/// Errors: kUnsupported for a name that make_codec() does not know.
[[nodiscard]] Result<CodecTraits> codec_traits(std::string_view name);

/// All that a codec needs to know. Views are read by make_codec() alone.
struct CodecSetup {
  std::string_view name;
  std::uint32_t capacity = 0;                ///< 1 .. kMaxCapacity
  std::span<const std::byte> tables = {};    ///< as the session has them; empty without takes_tables
  std::string_view predictor = "ballistic";  ///< Predictor::name() of the session; gains depend on it
  RunBlocks run_blocks = {};  ///< how to code blocks side by side, where a codec can; empty: one by one
};

/// Makes the codec a session names. Errors: kUnsupported for an unknown name, kMalformed for tables that do
/// not fit it, kInvalidArgument for the capacity.
[[nodiscard]] Result<std::unique_ptr<Codec>> make_codec(const CodecSetup& setup);

/// The names make_codec() knows: those of the paper's table 5.1 in its order, then ours.
[[nodiscard]] std::span<const std::string_view> codec_names();

}  // namespace tandem
