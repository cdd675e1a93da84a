#include "sdk/core/codec/paper/residual_coding.hpp"

namespace tandem {

HuffmanResiduals::HuffmanResiduals(const CodeLengths& position, const CodeLengths& velocity)
    : position_(position), velocity_(velocity) {}

unsigned HuffmanResiduals::bits(const Residual& q) const {
  unsigned sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    sum += position_.length(static_cast<std::uint8_t>(q[i])) +
           velocity_.length(static_cast<std::uint8_t>(q[i + 3]));
  }
  return sum;
}

void HuffmanResiduals::write(std::span<const Candidate> chosen, std::byte* to) const {
  BitWriter out(to);
  for (const Candidate& candidate : chosen) {
    const Residual& q = candidate.residual;
    for (std::size_t i = 0; i < 3; ++i) position_.put(out, static_cast<std::uint8_t>(q[i]));
    for (std::size_t i = 3; i < 6; ++i) velocity_.put(out, static_cast<std::uint8_t>(q[i]));
  }
  out.finish();
}

Result<void> HuffmanResiduals::read(std::span<const std::byte> values, std::span<Residual> residuals) const {
  BitReader in(values);
  // Three symbols to a refill: see kMaxCodeLength. Returns false when they reach past the end.
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
    if (!read_three(position_, q.data()) || !read_three(velocity_, q.data() + 3)) {
      return fail(ErrorCode::kMalformed, "truncated code stream");
    }
  }
  if (!in.at_end()) return fail(ErrorCode::kMalformed, "bytes after the code stream");
  return {};
}

}  // namespace tandem
