#include "sdk/core/codec/tracker/decoder.hpp"

#include <array>
#include <utility>

#include "sdk/core/layout/sections.hpp"

namespace tandem {
namespace {

using Index = TrackerModelIndex;

// Calls f for the number of each lane, written out.
template <std::size_t lanes, class F>
[[gnu::always_inline]] inline void each(F&& f) {
  [&]<std::size_t... lane>(std::index_sequence<lane...>) __attribute__((always_inline)) {
    (f(std::integral_constant<std::size_t, lane>{}), ...);
  }
  (std::make_index_sequence<lanes>{});
}

template <std::size_t lanes>
void flags_of(std::array<DecodingLane*, lanes> of, std::uint32_t from, std::uint32_t slots,
              const std::uint16_t* p1) {
  std::array<LaneDecoder, lanes> decoder;
  std::array<const std::uint16_t*, lanes> models{};
  std::array<Slot, lanes> first{};
  std::array<Slot*, lanes> next{};
  each<lanes>([&](auto lane) {
    decoder[lane] = of[lane]->decoder;
    first[lane] = of[lane]->first;
    models[lane] = of[lane]->flags;
    next[lane] = of[lane]->corrected_slots + of[lane]->corrected;
  });
  for (std::uint32_t s = from; s < slots; ++s) {
    each<lanes>([&](auto lane) {
      *next[lane] = first[lane] + s;
      next[lane] -= static_cast<std::int32_t>(decoder[lane].get(p1[models[lane][s]]));
    });
  }
  each<lanes>([&](auto lane) {
    of[lane]->decoder = decoder[lane];
    of[lane]->corrected = static_cast<std::uint32_t>(next[lane] - of[lane]->corrected_slots);
  });
}

void guess_flags(DecodingLane& lane, const std::uint16_t* p1) {
  LaneDecoder decoder = lane.decoder;
  std::uint32_t corrected = 0;
  for (std::uint32_t s = 0; s < lane.slots; ++s) {
    if (decoder.guess(p1[lane.flags[s]])) lane.corrected_slots[corrected++] = lane.first + s;
  }
  lane.decoder = decoder;
  lane.corrected = corrected;
}

// A body that is being read.
struct Reading {
  TrackerContext context;
  std::uint32_t moved = 0, longest = 0;
};

constexpr std::uint32_t kEven = 32768;  // the probability of an even decision

// A size that was read.
struct Size {
  std::uint32_t size_class, size;
  bool good;
};

// The result of any_size(), which fits into two registers. If it went through memory, the processor would
// wait until what was written can be read back in other parts.
struct AnySize {
  std::uint64_t range_and_code;
  std::uint64_t size : 32, size_class : 8, bytes : 16, good : 1;  // bytes: that were read
};

// Reads any size, of which `known` classes are below.
[[gnu::noinline]] AnySize any_size(std::uint64_t range_and_code, const std::byte* at, const std::byte* end,
                                   const std::uint16_t* p1, const std::uint16_t* classes,
                                   TrackerCounts& counts, std::uint32_t known) {
  LaneDecoder decoder;
  decoder.range = static_cast<std::uint32_t>(range_and_code >> 32U);
  decoder.code = static_cast<std::uint32_t>(range_and_code);
  decoder.at = at;
  decoder.end = end;
  std::uint32_t size_class = known;
  while (size_class < Index::kClasses) {
    std::uint32_t ones = decoder.get_ones(classes + size_class);
    if (ones > LaneDecoder::kRun) {
      ones = 0;
      while (ones < LaneDecoder::kRun && decoder.guess(classes[size_class + ones])) ++ones;
    }
    size_class += ones;
    if (ones < LaneDecoder::kRun) break;
  }
  std::uint32_t size = size_class + 1;
  bool good = true;
  if (size_class == Index::kClasses) {
    LaneReader rare{decoder, p1, &counts};  // a copy, so that the decoder stays in registers
    good = tracker_detail::code_escape(rare, Index::kSteps + Index::kEscape, size);
    size += tracker_detail::kBeyondClasses;
    decoder = rare.decoder;
  } else if (size_class >= Index::kShortClasses) {
    const auto [first, bits] = tracker_detail::kSizeClasses[size_class];
    const std::uint32_t model = Index::kSteps + Index::kPlace - Index::kShortClasses + size_class;
    size = decoder.get(p1[model]) & 1U;
    ++counts[model][size];
    for (unsigned bit = 1; bit < bits; ++bit) size = 2 * size + (decoder.get(kEven) & 1U);
    size += first;
  }
  return {std::uint64_t{decoder.range} << 32U | decoder.code, size, size_class & 255U,
          static_cast<std::uint64_t>(decoder.at - at) & 0xFFFFU, good};
}

// Reads a size: the first classes without a branch.
[[gnu::always_inline]] inline Size read_size(LaneDecoder& decoder, const std::uint16_t* p1,
                                             const std::uint16_t* classes, TrackerCounts& counts) {
  const std::uint32_t ones = decoder.get_ones(classes);
  if (ones < LaneDecoder::kRun) return {ones, ones + 1, true};
  const AnySize any = any_size(std::uint64_t{decoder.range} << 32U | decoder.code, decoder.at, decoder.end,
                               p1, classes, counts, ones == LaneDecoder::kRun ? LaneDecoder::kRun : 0);
  decoder.range = static_cast<std::uint32_t>(any.range_and_code >> 32U);
  decoder.code = static_cast<std::uint32_t>(any.range_and_code);
  decoder.at += any.bytes;
  return {static_cast<std::uint32_t>(any.size_class), static_cast<std::uint32_t>(any.size), any.good != 0};
}

[[gnu::always_inline]] inline std::uint32_t either(std::uint32_t mask, std::uint32_t a, std::uint32_t b) {
  return b ^ ((a ^ b) & mask);
}

// Does the same as code_axis(). If the axis does not move, its decisions are read with a probability of 0,
// which consumes no bits.
template <std::uint32_t axis>
[[gnu::always_inline]] inline bool read_axis(LaneDecoder& decoder, Reading& body, const std::uint16_t* p1,
                                             TrackerCounts& counts, SizeCounts& sizes, std::int32_t& steps) {
  std::uint32_t zero = zero_model(body.context, axis, body.moved);
  std::uint32_t implied = 0;
  if constexpr (axis == 2) {
    implied = 0U - static_cast<std::uint32_t>(body.moved == 0);
    zero = either(implied, Index::kDead, zero);
  }
  const std::uint32_t said = decoder.get(p1[zero]);
  ++counts[zero][said & 1U];
  const std::uint32_t moves = said | implied;
  const std::uint32_t sign = either(moves, body.context.sign[axis], Index::kDead);
  const std::uint32_t negative = decoder.get(p1[sign]);
  ++counts[sign][negative & 1U];
  const auto largest =
      static_cast<std::uint32_t>(body.longest > 0) + static_cast<std::uint32_t>(body.longest > 2);
  const std::uint32_t row =
      either(moves, body.context.magnitude[axis] * Index::kLargest + largest, SizeCounts::kNone);
  const std::uint16_t* const models =
      p1 + either(moves, Index::kSteps + Index::kMagnitude + row * Index::kClasses, Index::kDead);
  const Size size = read_size(decoder, p1, models, counts);
  sizes.add(row, size.size_class);
  const std::uint32_t length = size.size & moves;
  steps = static_cast<std::int32_t>((length ^ negative) - negative);
  body.moved -= moves;
  body.longest = std::max(body.longest, length);
  return size.good;
}

template <std::size_t lanes>
bool corrections_of(std::array<DecodingLane*, lanes> of, std::uint32_t from, std::uint32_t end,
                    const TrackerContexts& contexts, const std::uint16_t* p1) {
  std::array<LaneDecoder, lanes> decoder;
  std::array<SizeCounts, lanes> sizes;
  std::array<TrackerCounts*, lanes> counts{};
  each<lanes>([&](auto lane) {
    decoder[lane] = of[lane]->decoder;
    counts[lane] = of[lane]->counts;
  });
  bool good = true;
  for (std::uint32_t i = from; i < end && good; ++i) {
    std::array<Reading, lanes> body;
    std::array<TrackerCorrection*, lanes> correction{};
    each<lanes>([&](auto lane) {
      body[lane].context = contexts.of(of[lane]->corrected_slots[i]);
      correction[lane] = of[lane]->corrections + i;
      const std::uint32_t model = body[lane].context.rest;
      const std::uint32_t rest = decoder[lane].get(p1[model]);
      ++(*counts[lane])[model][rest & 1U];
      correction[lane]->rest = rest != 0;
    });
    const auto read = [&]<std::uint32_t axis>() __attribute__((always_inline)) {
      each<lanes>([&](auto lane) {
        good &= read_axis<axis>(decoder[lane], body[lane], p1, *counts[lane], sizes[lane],
                                correction[lane]->steps[axis]);
      });
    };
    read.template operator()<0>();
    read.template operator()<1>();
    read.template operator()<2>();
  }
  each<lanes>([&](auto lane) {
    of[lane]->decoder = decoder[lane];
    sizes[lane].add_to(*counts[lane]);
  });
  return good;
}

constexpr const char* kBeyond = "correction beyond any lattice";

// Bits become branches if bodies have fewer bits than this, in 1/10 of 8.
bool guesses(std::span<const DecodingLane> lanes, std::size_t bytes) {
  std::uint32_t slots = 0;
  for (const DecodingLane& lane : lanes) slots += lane.slots;
  return bytes * 10 < slots;
}

// Reads one block after the other, by the format's own text.
const char* read_one_by_one(const TrackerFrame& frame, std::span<DecodingLane> lanes) {
  for (DecodingLane& lane : lanes) {
    LaneReader coder{lane.decoder, frame.memory.models().p1.data(), lane.counts};
    for (std::uint32_t i = 0; i < lane.corrected; ++i) {
      TrackerTurningCorrection correction;
      if (!frame.code(coder, lane.corrected_slots[i], correction)) return kBeyond;
      lane.corrections[i] = static_cast<const TrackerCorrection&>(correction);
      if (frame.memory.turns()) frame.delta.turns[lane.first + i] = correction.turn;
    }
    lane.decoder = coder.decoder;
  }
  return nullptr;
}

// Returns null, or why a stream is invalid.
const char* decode_blocks(const TrackerFrame& frame, std::span<const TrackerDecoder::Part> parts) {
  std::array<DecodingLane, kLanes> all;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before it is read
  std::array<TrackerFlags, kLanes> flags;
  const std::span<DecodingLane> lanes = std::span(all).first(parts.size());
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const Block& block = parts[i].block;
    frame.list_flags(block, flags[i]);
    lanes[i] = {LaneDecoder(parts[i].stream),
                block.first,
                block.slots,
                0,
                frame.delta.slots.data() + block.first,
                frame.delta.corrections.data() + block.first,
                &frame.delta.blocks[block.index].counts,
                flags[i].data()};
    bytes += parts[i].stream.size();
  }
  const std::uint16_t* const p1 = frame.memory.models().p1.data();
  read_flags(lanes, p1, guesses(lanes, bytes));
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const std::span<const Slot> corrected(lanes[i].corrected_slots, lanes[i].corrected);
    if (corrected.empty()) return "corrections section without a body";
    for (const Slot slot : corrected)
      frame.delta.blocks[parts[i].block.index].count_one(flags[i][slot - lanes[i].first]);
    frame.list_contexts(parts[i].block, corrected);
  }
  if (kLanes == 1 || frame.memory.turns()) {
    if (const char* broken = read_one_by_one(frame, lanes)) return broken;
  } else if (!read_corrections(lanes, frame.scratch.contexts, p1)) {
    return kBeyond;
  }
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const bool is_padded = parts[i].stream.back() == std::byte{0};  // a zero that could have been left out
    if (lanes[i].decoder.at != lanes[i].decoder.end || is_padded) return "bytes after the code stream";
    frame.delta.blocks[parts[i].block.index].corrected = lanes[i].corrected;
  }
  return nullptr;
}

}  // namespace

void read_flags(std::span<DecodingLane> lanes, const std::uint16_t* p1, bool guess) {
  if (guess) {
    for (DecodingLane& lane : lanes) guess_flags(lane, p1);
    return;
  }
  std::uint32_t together = 0;
  if constexpr (kLanes == 2) {
    if (lanes.size() == 2) {
      together = std::min(lanes[0].slots, lanes[1].slots);
      flags_of<2>({&lanes[0], &lanes[1]}, 0, together, p1);
    }
  }
  for (DecodingLane& lane : lanes) flags_of<1>({&lane}, together, lane.slots, p1);
}

bool read_corrections(std::span<DecodingLane> lanes, const TrackerContexts& contexts,
                      const std::uint16_t* p1) {
  std::uint32_t together = 0;
  if constexpr (kLanes == 2) {
    if (lanes.size() == 2) {
      together = std::min(lanes[0].corrected, lanes[1].corrected);
      if (!corrections_of<2>({&lanes[0], &lanes[1]}, 0, together, contexts, p1)) return false;
    }
  }
  for (DecodingLane& lane : lanes) {
    if (!corrections_of<1>({&lane}, together, lane.corrected, contexts, p1)) return false;
  }
  return true;
}

Result<std::span<const Slot>> TrackerDecoder::decode(const TrackerFrame& frame,
                                                     std::span<const Section> sections) {
  busy_.clear();
  for (TrackerDelta::Part& part : frame.delta.blocks) part.corrected = 0;
  for (const Section& section : sections) {
    if (section.body.empty()) return fail(ErrorCode::kMalformed, "corrections section without a body");
    busy_.push_back({block_at(section.block, frame.memory.capacity()), section.body, nullptr});
  }
  const auto busy = static_cast<std::uint32_t>(busy_.size());
  const std::uint32_t together = frame.lanes_for(busy);
  const auto decode = [&](std::uint32_t job) {
    const std::uint32_t first = job * together;
    const std::span<Part> parts = std::span(busy_).subspan(first, std::min(together, busy - first));
    parts.front().broken = decode_blocks(frame, parts);
  };
  const std::uint32_t jobs = (busy + together - 1) / together;
  if (frame.run_blocks && jobs > 1) {
    frame.run_blocks(jobs, decode);
  } else {
    for (std::uint32_t job = 0; job < jobs; ++job) decode(job);
  }
  for (const Part& part : busy_) {
    if (part.broken != nullptr) return fail(ErrorCode::kMalformed, part.broken);
  }
  return frame.join();
}

}  // namespace tandem
