#include "sdk/core/codec/codec.hpp"

#include <array>
#include <string>

#include "sdk/core/codec/paper/absolute_coding.hpp"
#include "sdk/core/codec/paper/residual_coding.hpp"
#include "sdk/core/codec/tracker/tracker.hpp"

namespace tandem {
namespace {

constexpr std::array<std::string_view, 6> kNames{"none",    "selective", "quantized",
                                                 "entropy", "limited",   "tracker"};
Result<CodeLengths> read_lengths(std::span<const std::byte> bytes) {
  CodeLengths lengths{};
  for (std::size_t s = 0; s < kSymbols; ++s) lengths[s] = std::to_integer<std::uint8_t>(bytes[s]);
  if (!is_complete_code(lengths))
    return fail(ErrorCode::kMalformed, "code lengths are no complete prefix code");
  return lengths;
}

}  // namespace

std::span<const std::string_view> codec_names() { return kNames; }

void GainEvidence::add(const GainEvidence& more) {
  agreement += more.agreement;
  repeated += more.repeated;
  forwardness += more.forwardness;
  driven += more.driven;
}

Result<std::unique_ptr<Codec>> make_codec(std::string_view name, std::uint32_t capacity,
                                          std::span<const std::byte> tables) {
  if (capacity == 0 || capacity > kMaxCapacity)
    return fail(ErrorCode::kInvalidArgument, "capacity out of range");
  if (name == "entropy" || name == "limited") {
    if (tables.size() != 2 * kSymbols) {
      return fail(ErrorCode::kMalformed, "codec '" + std::string(name) + "' needs 512 code lengths, got " +
                                             std::to_string(tables.size()) +
                                             " (default_code_tables() has some)");
    }
    const auto position = read_lengths(tables.first(kSymbols));
    if (!position) return tl::unexpected<Error>(position.error());
    const auto velocity = read_lengths(tables.last(kSymbols));
    if (!velocity) return tl::unexpected<Error>(velocity.error());
    using Coding = ResidualCoding<HuffmanResiduals>;
    return std::make_unique<BlockCodec<Coding>>(name, capacity,
                                                Coding(capacity, HuffmanResiduals(*position, *velocity)));
  }
  if (std::find(kNames.begin(), kNames.end(), name) == kNames.end()) {
    std::string known;
    for (const std::string_view each : kNames) known += (known.empty() ? "" : ", ") + std::string(each);
    return fail(ErrorCode::kUnsupported, "unknown codec '" + std::string(name) + "' (known: " + known + ")");
  }
  if (!tables.empty())
    return fail(ErrorCode::kMalformed, "codec '" + std::string(name) + "' takes no tables");
  if (name == "none")
    return std::make_unique<BlockCodec<AbsoluteCoding<true>>>(name, capacity, AbsoluteCoding<true>(capacity));
  if (name == "selective") {
    return std::make_unique<BlockCodec<AbsoluteCoding<false>>>(name, capacity,
                                                               AbsoluteCoding<false>(capacity));
  }
  if (name == "tracker") return std::make_unique<Tracker>(capacity);
  using Coding = ResidualCoding<PlainResiduals>;
  return std::make_unique<BlockCodec<Coding>>(name, capacity, Coding(capacity, PlainResiduals{}));
}

}  // namespace tandem
