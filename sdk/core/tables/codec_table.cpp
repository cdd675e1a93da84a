#include "sdk/core/tables/codec_table.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "sdk/core/codec/paper/absolute_coding.hpp"
#include "sdk/core/codec/paper/residual_coding.hpp"
#include "sdk/core/codec/tracker/tracker.hpp"

namespace tandem {
namespace {

struct KnownCodec {
  std::string_view name;
  CodecTraits traits;
};
// TANDEM_FEW_CODECS: the browser's modules have to be small, and lack those that only comparisons need.
constexpr std::array kKnown{
#ifndef TANDEM_FEW_CODECS
    KnownCodec{"none", {.is_baseline = true, .turns = true}},
    KnownCodec{"selective", {.is_baseline = true, .reads_threshold = true, .turns = true}},
    KnownCodec{"quantized",
               {.is_baseline = true, .reads_threshold = true, .reads_steps = true, .turns = true}},
#endif
    KnownCodec{"entropy",
               {.is_baseline = true,
                .reads_threshold = true,
                .reads_steps = true,
                .takes_tables = true,
                .turns = true}},
    KnownCodec{"limited",
               {.is_baseline = true,
                .reads_threshold = true,
                .reads_steps = true,
                .takes_tables = true,
                .turns = true,
                .takes_budget = true,
                .usual_budget = kPaperBudgetBytes}},
    KnownCodec{"tracker",
               {.reads_threshold = true,
                .reads_gains = true,
                .keeps_rounding = true,
                .turns = true,
                .takes_budget = true}}};
constexpr auto kNames = [] {
  std::array<std::string_view, kKnown.size()> names{};
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kKnown[i].name;
  return names;
}();

Result<CodeLengths> read_lengths(std::span<const std::byte> bytes) {
  CodeLengths lengths{};
  for (std::size_t s = 0; s < kSymbols; ++s) lengths[s] = std::to_integer<std::uint8_t>(bytes[s]);
  if (!is_complete_code(lengths))
    return fail(ErrorCode::kMalformed, "code lengths are no complete prefix code");
  return lengths;
}

template <class Coding, class... Arguments>
std::unique_ptr<Codec> of(const CodecSetup& setup, Arguments&&... arguments) {
  return std::make_unique<BlockCodec<Coding>>(setup, Coding(std::forward<Arguments>(arguments)...));
}

}  // namespace

std::span<const std::string_view> codec_names() { return kNames; }

Result<CodecTraits> codec_traits(std::string_view name) {
  const auto* const known = std::find_if(kKnown.begin(), kKnown.end(),
                                         [name](const KnownCodec& each) { return each.name == name; });
  if (known != kKnown.end()) return known->traits;
  std::string names;
  for (const std::string_view each : kNames) names += (names.empty() ? "" : ", ") + std::string(each);
  return fail(ErrorCode::kUnsupported, "unknown codec '" + std::string(name) + "' (known: " + names + ")");
}

Result<std::unique_ptr<Codec>> make_codec(const CodecSetup& setup) {
  const std::string_view name = setup.name;
  const std::uint32_t capacity = setup.capacity;
  if (capacity == 0 || capacity > kMaxCapacity)
    return fail(ErrorCode::kInvalidArgument, "capacity out of range");
  const auto traits = codec_traits(name);
  if (!traits) return tl::unexpected<Error>(traits.error());
  if (!traits->takes_tables && !setup.tables.empty())
    return fail(ErrorCode::kMalformed, "codec '" + std::string(name) + "' takes no tables");
  if (name == "tracker") return std::make_unique<Tracker>(setup);
  const std::size_t vectors = residual_vectors(setup.groups);
#ifndef TANDEM_FEW_CODECS
  if (name == "none") return of<AbsoluteCoding<true>>(setup, capacity, setup.groups);
  if (name == "selective") return of<AbsoluteCoding<false>>(setup, capacity, setup.groups);
  if (name == "quantized")
    return of<ResidualCoding<PlainResiduals>>(setup, capacity, PlainResiduals(vectors));
#endif
  if (setup.tables.size() != vectors * kSymbols) {
    return fail(ErrorCode::kMalformed, "codec '" + std::string(name) + "' needs " +
                                           std::to_string(vectors * kSymbols) + " code lengths, got " +
                                           std::to_string(setup.tables.size()) +
                                           " (default_code_tables() has some)");
  }
  std::vector<CodeLengths> lengths;
  for (std::size_t vector = 0; vector < vectors; ++vector) {
    const auto read = read_lengths(setup.tables.subspan(vector * kSymbols, kSymbols));
    if (!read) return tl::unexpected<Error>(read.error());
    lengths.push_back(*read);
  }
  return of<ResidualCoding<HuffmanResiduals>>(setup, capacity, HuffmanResiduals(lengths));
}

}  // namespace tandem
