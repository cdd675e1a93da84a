#pragma once
// The table of codecs: all that anybody has to know of one by its name.

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

#include "sdk/core/codec/codec.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// `limited`: 0.05 Mbit per frame (paper, table 5.1), 2^20 bits to the Mbit.
inline constexpr std::size_t kPaperBudgetBytes = 6553;

/// What a codec is like, for those who choose, configure or compare codecs.
struct CodecTraits {
  bool is_baseline = false;      ///< of the paper: compared as the paper has it, with its predicted step
  bool reads_threshold = false;  ///< the others send every body
  bool reads_steps = false;      ///< quantisation steps
  bool reads_gains = false;      ///< and the decay that goes with them
  bool takes_tables = false;     ///< code lengths (code_tables.hpp)
  bool keeps_rounding = false;   ///< corrected bodies stay round: CodecFrame::position_bits
  bool turns = false;            ///< codes orientations too
  bool takes_budget = false;     ///< is meant to have one; any codec obeys it
  std::size_t usual_budget = kNoBudget;  ///< bytes a frame
};
/// Errors: kUnsupported for a name that make_codec() does not know.
[[nodiscard]] Result<CodecTraits> codec_traits(std::string_view name);

/// Makes the codec a session names. Errors: kUnsupported for an unknown name, kMalformed for tables that do
/// not fit it, kInvalidArgument for the capacity.
[[nodiscard]] Result<std::unique_ptr<Codec>> make_codec(const CodecSetup& setup);

/// The names make_codec() knows: those of the paper's table 5.1 in its order, then ours.
[[nodiscard]] std::span<const std::string_view> codec_names();

}  // namespace tandem
