#pragma once
// The table of codecs: what other code has to know about a codec, by its name.

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

#include "sdk/core/codec/codec.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// The budget of `limited`: 0.05 Mbit per frame (thesis, table 5.1); 1 Mbit = 2^20 bits.
inline constexpr std::size_t kPaperBudgetBytes = 6553;

/// The properties of a codec, for code that chooses, configures or compares codecs.
struct CodecTraits {
  bool is_baseline = false;      ///< a codec of the thesis; compared as in the thesis, with its predicted
                                 ///< step
  bool reads_threshold = false;  ///< false: the codec sends every body
  bool reads_steps = false;      ///< reads quantisation steps
  bool reads_gains = false;      ///< reads gains and the decay that belongs to them
  bool takes_tables = false;     ///< has code lengths (code_tables.hpp)
  bool keeps_rounding = false;   ///< corrected bodies stay rounded: CodecFrame::position_bits
  bool turns = false;            ///< also codes orientations
  bool takes_budget = false;     ///< is meant to have a budget; every codec obeys one
  std::size_t usual_budget = kNoBudget;  ///< bytes per frame
};
/// The properties of the codec `name`. Errors: kUnsupported for a name that make_codec() does not know.
[[nodiscard]] Result<CodecTraits> codec_traits(std::string_view name);

/// Makes the codec that a session names. Errors: kUnsupported for an unknown name, kMalformed for tables that
/// do not fit it, kInvalidArgument for the capacity.
[[nodiscard]] Result<std::unique_ptr<Codec>> make_codec(const CodecSetup& setup);

/// The names that make_codec() knows: those of the thesis's table 5.1 in its order, then Tandem's own.
[[nodiscard]] std::span<const std::string_view> codec_names();

}  // namespace tandem
