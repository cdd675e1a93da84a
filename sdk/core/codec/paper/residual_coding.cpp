#include "sdk/core/codec/paper/residual_coding.hpp"

#include "sdk/core/lattice/assert.hpp"

namespace tandem {

HuffmanResiduals::HuffmanResiduals(std::span<const CodeLengths> lengths)
    : codes_(lengths.begin(), lengths.end()) {
  TANDEM_ASSERT(3 * codes_.size() <= Residual{}.size());
}

unsigned HuffmanResiduals::most_bits() const {
  unsigned sum = 0;
  for (const HuffmanCode& code : codes_) sum += 3 * code.longest();
  return sum;
}

unsigned HuffmanResiduals::bits(const Residual& q) const {
  unsigned sum = 0;
  for (std::size_t i = 0; i < 3 * codes_.size(); ++i)
    sum += codes_[i / 3].length(static_cast<std::uint8_t>(q[i]));
  return sum;
}

void HuffmanResiduals::write(std::span<const Candidate> chosen, std::byte* to) const {
  BitWriter out(to);
  for (const Candidate& candidate : chosen) {
    const Residual& q = candidate.residual;
    for (std::size_t i = 0; i < 3 * codes_.size(); ++i)
      codes_[i / 3].put(out, static_cast<std::uint8_t>(q[i]));
  }
  out.finish();
}

Result<void> HuffmanResiduals::read(std::span<const std::byte> values, std::span<Residual> residuals) const {
  BitReader in(values);
  // Reads three symbols per refill: see kMaxCodeLength. Returns false if they reach beyond the end.
  const auto read_three = [&in](const HuffmanCode& code, std::int8_t* to) {
    in.refill();
    for (std::size_t i = 0; i < 3; ++i) {
      const HuffmanCode::Symbol symbol = code.peek(in.window());
      if (symbol.length > in.held()) return false;
      in.skip(symbol.length);
      to[i] = static_cast<std::int8_t>(symbol.value);
    }
    return true;
  };
  for (Residual& q : residuals) {
    for (std::size_t vector = 0; vector < codes_.size(); ++vector) {
      if (!read_three(codes_[vector], q.data() + 3 * vector))
        return fail(ErrorCode::kMalformed, "truncated code stream");
    }
  }
  if (!in.at_end()) return fail(ErrorCode::kMalformed, "bytes after the code stream");
  return {};
}

}  // namespace tandem
