#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "sdk/core/codec/paper/residual.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

using synthetic::Random;

/// One random session: codec, capacity (several blocks now and then), how much moves, how much lives.
struct Session {
  std::string_view codec = codec_names()[*rc::gen::inRange<std::size_t>(0, codec_names().size())];
  bool several_blocks = *rc::gen::weightedElement<bool>({{19, false}, {1, true}});
  std::uint32_t capacity = several_blocks ? *rc::gen::inRange<std::uint32_t>(kBlockSlots, 3 * kBlockSlots)
                                          : *rc::gen::inRange(1U, 400U);
  std::uint64_t dead_one_in = *rc::gen::element<std::uint64_t>(0, 1, 2, 10);
  std::uint64_t moved_one_in = *rc::gen::element<std::uint64_t>(0, 1, 2, 20, 1000);
  std::uint64_t seed = *rc::gen::arbitrary<std::uint64_t>();
  Groups groups = {};

  [[nodiscard]] bool is_exact() const { return codec == "none" || codec == "selective"; }
  [[nodiscard]] StreamParameters start() const {
    return synthetic::with_turn_steps({{200, 16, 64}}, codec, groups);
  }
  [[nodiscard]] DeltaCodec delta(const StreamParameters& parameters) const {
    return synthetic::make_delta(codec, capacity, parameters, {}, groups);
  }
  [[nodiscard]] State state(Random& random) const {
    return synthetic::random_state(random, capacity, dead_one_in, groups);
  }
  /// The error that makes a correction due; the larger one goes first.
  [[nodiscard]] std::uint64_t error(const State& state, const State& target, Slot slot) const {
    if (!groups.orientation) return error_squared(state, target, slot);
    if (state.alive()[slot] == 0) return 0;
    return surface_error(state.body(slot), target.body(slot), synthetic::kRadii[target.type()[slot]]);
  }
  [[nodiscard]] std::uint64_t limit(std::int32_t threshold) const {
    const auto t = static_cast<std::uint64_t>(threshold);
    return groups.orientation ? t : t * t;
  }
};

/// One of the thesis's codecs on bodies that turn.
Session turning_session() {
  Session session;
  session.codec = codec_names()[*rc::gen::inRange<std::size_t>(0, 5)];
  session.groups = synthetic::kTurning;
  return session;
}

StreamParameters random_parameters(Random& random, const StreamParameters& start) {
  const auto positive = [&random](std::int32_t most) { return 1 + std::abs(random.value(most - 1)); };
  StreamParameters parameters{{positive(1 << 20), positive(kMaxStep), positive(kMaxStep)}};
  if (!has_turn_steps(start.codec)) return parameters;
  parameters.codec.turn_step = positive(kMaxStep);
  parameters.codec.spin_step = positive(kMaxStep);
  return parameters;
}

void leaves_both_sides_with_the_same_state(const Session& session) {
  Random random(session.seed);
  DeltaCodec server = session.delta(session.start());
  DeltaCodec client = session.delta(session.start());
  std::vector<std::byte> out(server.bound());
  State agreed = session.state(random);
  State held = agreed;
  for (int frame = 0; frame < 4; ++frame) {
    if (random.one_in(3)) server.set_parameters(random_parameters(random, session.start()));
    if (random.one_in(3)) server.round_next();
    State target = synthetic::random_target(random, agreed, session.moved_one_in);
    const auto lifecycle =
        synthetic::random_lifecycle(random, agreed, target, 1 + random.below(session.capacity));
    const std::size_t budget = random.one_in(2) ? kNoBudget : random.below(12 * session.capacity + 20);
    const auto encoded = server.encode(agreed, target, lifecycle, budget, out);
    RC_ASSERT(encoded.size_bytes <= server.bound());
    RC_ASSERT(encoded.correction_bytes <= budget);
    const auto decoded = synthetic::receive(client, held, std::span(out).first(encoded.size_bytes));
    RC_ASSERT(decoded.has_value());
    RC_ASSERT(held == agreed);
    RC_ASSERT(synthetic::broken_invariant(held) == nullptr);
    const auto touched_there = server.touched();
    const auto touched_here = client.touched();
    RC_ASSERT(
        std::equal(touched_there.begin(), touched_there.end(), touched_here.begin(), touched_here.end()));
    RC_ASSERT(std::adjacent_find(touched_here.begin(), touched_here.end(), std::greater_equal<>()) ==
              touched_here.end());
  }
}

RC_GTEST_PROP(AnyCodec, LeavesEncoderAndDecoderWithTheSameState, ()) {
  leaves_both_sides_with_the_same_state({});
}
RC_GTEST_PROP(TurningCodec, LeavesEncoderAndDecoderWithTheSameState, ()) {
  leaves_both_sides_with_the_same_state(turning_session());
}

void corrects_what_is_beyond_the_threshold_and_nothing_else(const Session& session) {
  Random random(session.seed);
  const StreamParameters parameters = random_parameters(random, session.start());
  DeltaCodec server = session.delta(parameters);
  std::vector<std::byte> out(server.bound());
  const State predicted = session.state(random);
  const State target = synthetic::random_target(random, predicted, session.moved_one_in);
  State agreed = predicted;
  server.encode(agreed, target, {}, kNoBudget, out);
  const std::uint64_t limit = session.limit(parameters.codec.threshold);
  // The maximum residual of one axis after a correction.
  const auto settled = [](std::int32_t before, std::int32_t after, std::int32_t wanted, std::int32_t step) {
    const std::uint32_t error_before = magnitude(before, wanted);
    const std::uint32_t range = 127 * static_cast<std::uint32_t>(step);
    const std::uint32_t error = magnitude(after, wanted);
    return error <= static_cast<std::uint32_t>(step + 1) / 2 ||
           (error_before > range && error == error_before - range);
  };
  for (Slot slot = 0; slot < session.capacity; ++slot) {
    const bool beyond = session.error(predicted, target, slot) > limit;
    if (session.is_exact()) {
      const bool sent = predicted.alive()[slot] != 0 && (beyond || session.codec == "none");
      RC_ASSERT(agreed.body(slot) == (sent ? target : predicted).body(slot));
      continue;
    }
    if (session.codec == "tracker") {
      // It may send a body early, and may leave any error up to the threshold where it sends.
      RC_ASSERT(error_squared(agreed, target, slot) <= std::max<std::uint64_t>(limit, 3));
      continue;
    }
    if (!beyond) {
      RC_ASSERT(agreed.body(slot) == predicted.body(slot));
      continue;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      RC_ASSERT(settled(predicted.p(i)[slot], agreed.p(i)[slot], target.p(i)[slot],
                        parameters.codec.position_step));
      RC_ASSERT(settled(predicted.v(i)[slot], agreed.v(i)[slot], target.v(i)[slot],
                        parameters.codec.velocity_step));
    }
  }
}

RC_GTEST_PROP(AnyCodec, CorrectsWhatIsBeyondTheThresholdAndNothingElse, ()) {
  corrects_what_is_beyond_the_threshold_and_nothing_else({});
}
RC_GTEST_PROP(TurningCodec, CorrectsWhatIsBeyondTheThresholdAndNothingElse, ()) {
  corrects_what_is_beyond_the_threshold_and_nothing_else(turning_session());
}

void leaves_nothing_out_that_is_worse_than_what_it_sends(const Session& session) {
  Random random(session.seed);
  const State predicted = session.state(random);
  const State target = synthetic::random_target(random, predicted, session.moved_one_in);
  DeltaCodec server = session.delta(session.start());
  std::vector<std::byte> out(server.bound());
  State agreed = predicted;
  const auto all = server.encode(agreed, target, {}, kNoBudget, out);
  const std::vector<Slot> everything(server.touched().begin(), server.touched().end());
  agreed = predicted;
  const std::size_t budget = random.below(all.correction_bytes + 2);
  const auto some = server.encode(agreed, target, {}, budget, out);
  RC_ASSERT(some.correction_bytes <= budget);
  const auto order = [&](Slot slot) { return std::pair(~session.error(predicted, target, slot), slot); };
  std::vector<Slot> left_out;
  std::set_difference(everything.begin(), everything.end(), server.touched().begin(), server.touched().end(),
                      std::back_inserter(left_out));
  RC_ASSERT(left_out.size() + server.touched().size() == everything.size());
  if (some.correction_bytes == all.correction_bytes) RC_ASSERT(left_out.empty());
  std::pair<std::uint64_t, Slot> worst_sent{0, 0};
  for (const Slot slot : server.touched()) worst_sent = std::max(worst_sent, order(slot));
  for (const Slot slot : left_out) RC_ASSERT(some.corrected == 0 || worst_sent < order(slot));
}

RC_GTEST_PROP(AnyCodec, UnderABudgetNothingLeftOutIsWorseThanWhatWasSent, ()) {
  const Session session;
  RC_PRE(session.codec != "tracker");  // weighs waiting too, and learns from the first encode
  leaves_nothing_out_that_is_worse_than_what_it_sends(session);
}
RC_GTEST_PROP(TurningCodec, UnderABudgetNothingLeftOutIsWorseThanWhatWasSent, ()) {
  leaves_nothing_out_that_is_worse_than_what_it_sends(turning_session());
}

RC_GTEST_PROP(AnyCodec, TheEncoderRepeatsItself, ()) {
  const Session session;
  const bool learns = session.codec == "tracker";
  Random random(session.seed);
  const State predicted = synthetic::random_state(random, session.capacity, session.dead_one_in);
  const State target = synthetic::random_target(random, predicted, session.moved_one_in);
  const std::size_t budget = random.below(10 * session.capacity);
  std::vector<std::byte> first;
  DeltaCodec used = synthetic::make_delta(session.codec, session.capacity, {{200, 16, 64}});
  for (int round = 0; round < 3; ++round) {
    DeltaCodec fresh = synthetic::make_delta(session.codec, session.capacity, {{200, 16, 64}});
    DeltaCodec& server = round == 0 || learns ? fresh : used;
    std::vector<std::byte> out(server.bound());
    State state = predicted;
    out.resize(server.encode(state, target, {}, budget, out).size_bytes);
    if (round == 0) first = out;
    RC_ASSERT(out == first);
  }
}

RC_GTEST_PROP(AnyCodec, RepeatedCorrectionReachesTheTarget, ()) {
  const Session session;
  RC_PRE(!session.several_blocks);
  Random random(session.seed);
  DeltaCodec server = synthetic::make_delta(session.codec, session.capacity, {{1 << 21, 1 << 20, 1 << 20}});
  std::vector<std::byte> out(server.bound());
  State agreed = synthetic::random_state(random, session.capacity, session.dead_one_in);
  const State target = synthetic::random_target(random, agreed, session.moved_one_in);
  // 2^31 apart at most: 17 frames of 127 * 2^20.
  for (int frame = 0; frame < 18; ++frame) server.encode(agreed, target, {}, kNoBudget, out);
  for (Slot slot = 0; slot < session.capacity; ++slot) {
    RC_ASSERT(error_squared(agreed, target, slot) <= std::uint64_t{1} << 42U);
  }
}

}  // namespace
}  // namespace tandem
