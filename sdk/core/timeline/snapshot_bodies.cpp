#include "sdk/core/timeline/snapshot_bodies.hpp"

#include <bit>
#include <vector>

#include "sdk/core/codec/numbers.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/fixed_point.hpp"

namespace tandem {
namespace {

// Codes one column. Bodies at rest have their own models, because most have v = 0 and the same c.
class ColumnCoder {
 public:
  explicit ColumnCoder(Guess guess) : guess_(guess) {}

  /// Codes the number of the next body; `x` is what an encoder writes. `norm`: the guess for kNorm.
  template <class Coder>
  [[gnu::always_inline]] std::int64_t code(Coder& coder, bool at_rest, std::int64_t x, std::int64_t norm) {
    Kind& kind = kinds_[at_rest ? 1 : 0];
    if (guess_ == Guess::kNorm) kind.guess = norm;
    const bool is_same = guess_ == Guess::kSame;
    const std::int64_t number = code_number(coder, kind.models, is_same ? kind.exchanged(x) : x - kind.guess);
    x = is_same ? kind.exchanged(number) : kind.guess + number;
    if (is_same || guess_ == Guess::kBefore ||
        (at_rest && (guess_ == Guess::kHalf || guess_ == Guess::kRest)))
      kind.guess = x;
    if (guess_ == Guess::kHalf && !at_rest) kind.guess = (kind.guess + x) >> 1;
    return x;
  }

 private:
  struct Kind {
    /// 0 and the guess change places.
    [[nodiscard]] std::int64_t exchanged(std::int64_t x) const { return x == 0 ? guess : x == guess ? 0 : x; }

    std::int64_t guess = 0;
    NumberModels models;
  };
  Guess guess_;
  std::array<Kind, 2> kinds_;
};

// The component of a quaternion that gives a norm of 1 with the others; not negative.
class MissingComponent {
 public:
  explicit MissingComponent(const std::array<std::span<const std::int32_t>, 3>& others) : others_(others) {}
  [[nodiscard]] std::int64_t of(Slot slot) const {
    std::uint64_t squared = 0;
    for (const auto& column : others_)
      squared += static_cast<std::uint64_t>(std::int64_t{column[slot]} * column[slot]);
    constexpr std::uint64_t kOne = std::uint64_t{1} << 60U;
    return squared >= kOne ? 0 : static_cast<std::int64_t>(square_root(kOne - squared));
  }

 private:
  std::array<std::span<const std::int32_t>, 3> others_;
};

// Numbers that are all multiples of 2^n are written without their n lowest bits.
constexpr unsigned kShiftBits = 5;
constexpr std::int64_t kBeyond = std::int64_t{1} << 33;  // of all columns

class BodiesWriter {
 public:
  BodiesWriter(const State& state, std::span<std::byte> out) : coder_(out) {
    std::array<LearningModel, 2> models;
    bool before = false;
    for (Slot slot = 0; slot < state.capacity(); ++slot) {
      before = coder_.decide(state.alive()[slot] != 0, models[before ? 1 : 0]);
      if (before) bodies_.push_back(slot);
    }
    values_.resize(bodies_.size());
  }
  template <class T>
  void column(std::span<const T> column, Guess guess, std::int64_t /*least*/, std::int64_t /*most*/,
              const MissingComponent* missing = nullptr) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) values_[i] = std::int64_t{column[bodies_[i]]};
    write_values(guess, missing);
  }
  /// From the next column on, bodies at rest have their own models.
  void know_rest(std::span<const std::uint8_t> rest) { rest_ = rest; }
  NumberEncoder& coder() { return coder_; }

 private:
  // One copy for columns of all types: it is most of the code.
  void write_values(Guess guess, const MissingComponent* missing) {
    std::uint64_t used = 0;
    for (const std::int64_t value : values_) used |= static_cast<std::uint64_t>(value);
    const auto shift = static_cast<unsigned>(used == 0 ? 0 : std::countr_zero(used));
    coder_.even(shift, kShiftBits);
    ColumnCoder numbers(guess);
    NumberEncoder coder = coder_;  // a copy, so that it stays in registers while bytes are written
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Slot slot = bodies_[i];
      numbers.code(coder, !rest_.empty() && rest_[slot] != 0, values_[i] >> shift,
                   missing == nullptr ? 0 : missing->of(slot) >> shift);
    }
    coder_ = coder;
  }

  NumberEncoder coder_;
  std::span<const std::uint8_t> rest_;
  std::vector<Slot> bodies_;
  std::vector<std::int64_t> values_;  // of one column, by body
};

class BodiesReader {
 public:
  BodiesReader(State& state, std::span<const std::byte> in) : coder_(in) {
    std::array<LearningModel, 2> models;
    bool before = false;
    for (Slot slot = 0; slot < state.capacity(); ++slot) {
      before = coder_.decide(false, models[before ? 1 : 0]);
      if (!before) continue;
      state.alive()[slot] = 1;
      bodies_.push_back(slot);
    }
    values_.resize(bodies_.size());
  }
  template <class T>
  void column(std::span<T> column, Guess guess, std::int64_t least, std::int64_t most,
              const MissingComponent* missing = nullptr) {
    if (good_) read_values(guess, missing);
    for (std::size_t i = 0; i < bodies_.size() && good_; ++i) {
      good_ = values_[i] >= least && values_[i] <= most;
      if (good_) column[bodies_[i]] = static_cast<T>(values_[i]);
    }
  }
  void know_rest(std::span<const std::uint8_t> rest) { rest_ = rest; }
  [[nodiscard]] bool good() const { return good_; }
  NumberDecoder& coder() { return coder_; }

 private:
  void read_values(Guess guess, const MissingComponent* missing) {
    const unsigned shift = coder_.even(0, kShiftBits);
    ColumnCoder numbers(guess);
    NumberDecoder coder = coder_;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Slot slot = bodies_[i];
      const std::int64_t x = numbers.code(coder, !rest_.empty() && rest_[slot] != 0, 0,
                                          missing == nullptr ? 0 : missing->of(slot) >> shift);
      // A number has at most 32 bits, and valid guesses have too.
      good_ = x > -kBeyond && x < kBeyond;
      if (!good_) break;
      values_[i] = x * (std::int64_t{1} << shift);
    }
    coder_ = coder;
  }

  NumberDecoder coder_;
  std::span<const std::uint8_t> rest_;
  std::vector<Slot> bodies_;
  std::vector<std::int64_t> values_;  // of one column, by body
  bool good_ = true;
};

// Passes all columns in their order to a writer or a reader.
template <class Columns, class TheState, class CodecColumns>
void code_columns(Columns& columns, TheState& state, const Codec& codec, CodecColumns codec_columns,
                  std::int64_t most_type) {
  columns.column(state.rest(), Guess::kZero, 0, 1);
  columns.know_rest(state.rest());
  columns.column(state.reuse(), Guess::kZero, 0, UINT8_MAX);
  columns.column(state.type(), Guess::kZero, 0, most_type);
  for_each_group(state.groups(), [&](const ChannelGroup& group) {
    for_each_column(group, [&](std::size_t column, const ColumnRun& run) {
      if (run.guess != Guess::kNorm)
        return columns.column(state.column(column), run.guess, -run.limit, run.limit);
      const MissingComponent missing(
          {state.column(column - 3), state.column(column - 2), state.column(column - 1)});
      columns.column(state.column(column), run.guess, -run.limit, run.limit, &missing);
    });
  });
  for (std::size_t at = 0; at < codec_columns.size(); at += state.capacity())
    columns.column(codec_columns.subspan(at, state.capacity()), codec.guess(at / state.capacity()), INT8_MIN,
                   INT8_MAX);
  for (std::size_t at = 0; at < state.own().size(); at += state.capacity())
    columns.column(state.own().subspan(at, state.capacity()), Guess::kBefore, 0, UINT8_MAX);
}

// Checks what the limits of columns do not cover.
bool bodies_are_valid(const State& state) {
  for (Slot slot = 0; slot < state.capacity(); ++slot) {
    if (state.alive()[slot] != 0 && !valid_body(state.body(slot))) return false;
  }
  return true;
}

std::span<const std::int8_t> numbers(std::span<const std::byte> columns) {
  return {reinterpret_cast<const std::int8_t*>(columns.data()), columns.size()};
}
std::span<std::int8_t> numbers(std::span<std::byte> columns) {
  return {reinterpret_cast<std::int8_t*>(columns.data()), columns.size()};
}

}  // namespace

std::size_t bodies_bytes_bound(const State& state, const Codec& codec) {
  const std::uint32_t capacity = state.capacity();
  TANDEM_ASSERT(codec.columns().size() % capacity == 0 && state.own().size() % capacity == 0);
  // Differences of two numbers have a bit more than the numbers.
  std::size_t slot_bits =
      1 + most_number_bits(1) + most_number_bits(UINT8_MAX) + most_number_bits(UINT16_MAX) +
      (codec.columns().size() + state.own().size()) / capacity * most_number_bits(UINT8_MAX);
  for_each_group(state.groups(), [&](const ChannelGroup& group) {
    for (const ColumnRun& run : group.runs)
      slot_bits += run.columns * most_number_bits(2 * static_cast<std::uint32_t>(run.limit));
  });
  const std::size_t bits = capacity * slot_bits + codec.models_bits_bound();
  constexpr std::size_t kFixedBytes = 256;  // hash, shifts, and the cost of models before they have
                                            // learned
  return kFixedBytes + bits / 8 + bits / 256;
}

void write_bodies(std::uint64_t leaves_hash, const State& state, const Codec& codec, ByteWriter& out) {
  out.put(leaves_hash);
  BodiesWriter bodies(state, out.rest());
  code_columns(bodies, state, codec, numbers(codec.columns()), UINT16_MAX);
  codec.save_models(bodies.coder());
  const std::size_t size = bodies.coder().finish();
  // An overflow is reported as one byte more than there is room for.
  out.advance(bodies.coder().overflow() ? out.rest().size() + 1 : size);
}

Result<std::uint64_t> read_bodies(std::span<const std::byte> section, TypeId type_count, State& state,
                                  Codec& codec) {
  ByteReader in(section);
  const auto leaves_hash = in.get<std::uint64_t>();
  if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated bodies of a snapshot");
  const auto own_bytes = static_cast<std::uint32_t>(state.own().size() / state.capacity());
  state = State(state.capacity(), state.groups());
  state.keep_for_predictor(own_bytes);
  BodiesReader bodies(state, in.get_bytes(in.remaining()));
  std::vector<std::byte> columns(codec.columns().size());
  code_columns(bodies, state, codec, numbers(std::span(columns)), type_count - 1);
  if (!bodies.good() || !bodies_are_valid(state))
    return fail(ErrorCode::kMalformed, "snapshot value out of range");
  if (auto loaded = codec.load(columns, bodies.coder()); !loaded)
    return tl::unexpected<Error>(loaded.error());
  return leaves_hash;
}

}  // namespace tandem
