#pragma once
// Sends absolute values: position and velocity, six int32 per body; with orientations also quaternion and
// angular velocity, seven more (`none`, `selective`; thesis, section 3.3.1).

#include <cstring>
#include <vector>

#include "sdk/core/codec/paper/block_codec.hpp"

namespace tandem {

/// `EveryBody`: true for `none`, which sends all alive bodies; false for `selective`, which sends those
/// beyond the threshold. Applying sets c = 0.
template <bool EveryBody>
class AbsoluteCoding {
 public:
  static constexpr bool kEveryBody = EveryBody;

  AbsoluteCoding(std::uint32_t capacity, const Groups& groups)
      : groups_(bits_of(groups)), body_bytes_(body_bytes(groups_)) {
    sections_.reserve(block_count(capacity));
  }
  [[nodiscard]] unsigned most_bits() const { return static_cast<unsigned>(8 * body_bytes_); }
  bool measure(const State&, const State&, const CodecParameters&, Candidate& candidate) const {
    candidate.bits = static_cast<std::uint16_t>(most_bits());
    return true;
  }
  void begin() { sections_.clear(); }
  void write(const State& target, std::span<const Candidate> chosen, std::size_t first,
             std::span<std::byte> to) {
    ByteWriter out(to);
    for (const Candidate& candidate : chosen) {
      const BodyState body = clamped(target.body(candidate.slot));
      TANDEM_ASSERT(valid_body(body));
      put_body(groups_, body, out);
    }
    sections_.push_back({to, first});
  }
  Result<void> parse(std::span<const std::byte> values, std::span<const Slot> slots, std::size_t first) {
    if (values.size() != slots.size() * body_bytes_)
      return fail(ErrorCode::kMalformed, "corrections of wrong length");
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const BodyState body = read(values.subspan(i * body_bytes_, body_bytes_));
      if (!valid_body(body))
        return fail(ErrorCode::kMalformed, "correction beyond the lattice, or of no orientation");
    }
    sections_.push_back({values, first});
    return {};
  }
  void apply(State& state, std::span<const Slot> slots, const CodecParameters&) const {
    for (const Section& section : sections_) {
      for (std::size_t i = 0; i < section.values.size() / body_bytes_; ++i) {
        state.set_body(slots[section.first + i], read(section.values.subspan(i * body_bytes_, body_bytes_)));
      }
    }
  }

 private:
  struct Section {
    std::span<const std::byte> values;
    std::size_t first = 0;  // index of its first slot among all corrected ones
  };
  static BodyState clamped(BodyState body) {
    for (std::int32_t& value : body.p) value = std::clamp(value, -kPositionLimit, kPositionLimit);
    for (std::int32_t& value : body.v) value = std::clamp(value, -kVelocityLimit, kVelocityLimit);
    return body;
  }
  [[nodiscard]] BodyState read(std::span<const std::byte> bytes) const {
    ByteReader in(bytes);
    BodyState body;
    get_body(groups_, in, body);
    return body;
  }

  unsigned groups_;  // bits
  std::size_t body_bytes_;
  std::vector<Section> sections_;
};

}  // namespace tandem
