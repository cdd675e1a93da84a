#pragma once
// Quantised residuals (thesis, section 3.3.2) as bytes (`quantized`) or Huffman codes (`entropy`, `limited`).

#include <cstring>
#include <vector>

#include "sdk/core/codec/paper/block_codec.hpp"
#include "sdk/core/codec/paper/huffman.hpp"

namespace tandem {

/// Bytes: 3 for each vector.
class PlainResiduals {
 public:
  explicit PlainResiduals(std::size_t vectors) : body_bytes_(3 * vectors) {}
  [[nodiscard]] unsigned most_bits() const { return static_cast<unsigned>(8 * body_bytes_); }
  [[nodiscard]] unsigned bits(const Residual&) const { return most_bits(); }
  void write(std::span<const Candidate> chosen, std::byte* to) const {
    for (const Candidate& candidate : chosen) {
      std::memcpy(to, candidate.residual.data(), body_bytes_);
      to += body_bytes_;
    }
  }
  [[nodiscard]] Result<void> read(std::span<const std::byte> values, std::span<Residual> residuals) const {
    if (values.size() != residuals.size() * body_bytes_)
      return fail(ErrorCode::kMalformed, "corrections of wrong length");
    for (std::size_t i = 0; i < residuals.size(); ++i)
      std::memcpy(residuals[i].data(), values.data() + i * body_bytes_, body_bytes_);
    return {};
  }

 private:
  std::size_t body_bytes_;
};

/// Canonical Huffman codes, with one table for each vector.
class HuffmanResiduals {
 public:
  explicit HuffmanResiduals(std::span<const CodeLengths> lengths);
  [[nodiscard]] unsigned most_bits() const;
  [[nodiscard]] unsigned bits(const Residual& q) const;
  void write(std::span<const Candidate> chosen, std::byte* to) const;
  [[nodiscard]] Result<void> read(std::span<const std::byte> values, std::span<Residual> residuals) const;

 private:
  std::vector<HuffmanCode> codes_;
};

/// Codes bodies beyond the threshold as residuals. Later frames correct what exceeds the range of 127 steps.
template <class Bits>
class ResidualCoding {
 public:
  static constexpr bool kEveryBody = false;

  ResidualCoding(std::uint32_t capacity, Bits bits) : bits_(std::move(bits)), residuals_(capacity) {}
  [[nodiscard]] unsigned most_bits() const { return bits_.most_bits(); }
  bool measure(const State& state, const State& target, const CodecParameters& parameters,
               Candidate& candidate) const {
    candidate.residual = quantise(state, target, candidate.slot, parameters);
    candidate.bits = static_cast<std::uint16_t>(bits_.bits(candidate.residual));
    // With steps wider than the threshold all residuals may round to zero; sending them would change nothing.
    return candidate.residual != Residual{};
  }
  static void begin() {}
  void write(const State&, std::span<const Candidate> chosen, std::size_t first, std::span<std::byte> to) {
    bits_.write(chosen, to.data());
    for (std::size_t i = 0; i < chosen.size(); ++i) residuals_[first + i] = chosen[i].residual;
  }
  Result<void> parse(std::span<const std::byte> values, std::span<const Slot> slots, std::size_t first) {
    return bits_.read(values, std::span(residuals_).subspan(first, slots.size()));
  }
  void apply(State& state, std::span<const Slot> slots, const CodecParameters& parameters) const {
    for (std::size_t i = 0; i < slots.size(); ++i) apply_residual(state, slots[i], residuals_[i], parameters);
  }

 private:
  Bits bits_;
  std::vector<Residual> residuals_;
};

}  // namespace tandem
