#include "sdk/core/codec/delta.hpp"
#include "sdk/core/tables/codec_table.hpp"

#include <gtest/gtest.h>

#include "tests/property/synthetic.hpp"

namespace tandem::of_delta {
namespace {

using synthetic::make_delta;
using Bytes = std::vector<std::byte>;

constexpr StreamParameters kParameters{{100, 10, 20}};

// Slots 0, 1, 2 alive, 3 dead.
State three_of_four() {
  State state(4);
  for (Slot slot = 0; slot < 3; ++slot)
    state.spawn(slot, 0, 0, {{static_cast<std::int32_t>(slot), 0, 0}, {}});
  return state;
}

class Payload {
 public:
  Payload& section(std::uint8_t type, std::initializer_list<int> body) {
    Bytes bytes;
    for (const int byte : body) bytes.push_back(static_cast<std::byte>(byte));
    return section(type, bytes);
  }
  Payload& section(SectionType type, const Bytes& body) {
    return section(static_cast<std::uint8_t>(type), body);
  }
  Payload& parameters(const StreamParameters& values) {
    return section(SectionType::kParameters,
                   written([&](ByteWriter& out) { write_parameters(values, nullptr, out); }));
  }
  Payload& record(LifecycleKind kind, Slot slot, TypeId type = 0, std::int32_t px = 0, std::int32_t vx = 0) {
    const Bytes record = written([&](ByteWriter& out) {
      out.put_leb128(4 * (slot - previous_) + static_cast<std::uint32_t>(kind));
      if (kind == LifecycleKind::kSpawn) out.put(std::uint8_t{9});
      if (kind == LifecycleKind::kSpawn || kind == LifecycleKind::kTypeChange) out.put_leb128(type);
      if (kind == LifecycleKind::kTeleport) out.put(std::uint8_t{1});
      if (kind == LifecycleKind::kSpawn || kind == LifecycleKind::kTeleport) {
        for (const std::int32_t value : {px, 0, 0, vx, 0, 0}) out.put(value);
      }
    });
    previous_ = slot;
    records_.insert(records_.end(), record.begin(), record.end());
    return *this;
  }
  Payload& end_lifecycle() {
    section(SectionType::kLifecycle, records_);
    records_.clear();
    return *this;
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  template <class Write>
  static Bytes written(const Write& write) {
    Bytes memory(100);
    ByteWriter out(memory);
    write(out);
    memory.resize(out.size());
    return memory;
  }
  Payload& section(std::uint8_t type, const Bytes& body) {
    bytes_.push_back(static_cast<std::byte>(type));
    const Bytes length = written([&](ByteWriter& out) { out.put_leb128(body.size()); });
    bytes_.insert(bytes_.end(), length.begin(), length.end());
    bytes_.insert(bytes_.end(), body.begin(), body.end());
    return *this;
  }
  Slot previous_ = 0;
  Bytes bytes_, records_;
};

// Decodes into three_of_four(); a refusal must leave it alone.
Result<State> decode(const Bytes& payload, std::string_view codec = "quantized") {
  DeltaCodec delta = make_delta(codec, 4, kParameters);
  State state = three_of_four();
  const auto decoded = synthetic::receive(delta, state, payload);
  if (decoded) return state;
  EXPECT_EQ(state, three_of_four());
  EXPECT_EQ(delta.parameters(), kParameters);
  EXPECT_TRUE(delta.touched().empty());
  EXPECT_TRUE(delta.lifecycle().empty());
  return tl::unexpected<Error>(decoded.error());
}

TEST(DeltaCodec, AnEmptyPayloadChangesNothing) {
  const auto state = decode({});
  ASSERT_TRUE(state);
  EXPECT_EQ(*state, three_of_four());
}

TEST(DeltaCodec, TheFourRecordsDoWhatTheySay) {
  const auto state = decode(Payload()
                                .record(LifecycleKind::kDespawn, 0)
                                .record(LifecycleKind::kTeleport, 1, 0, 50, 6)
                                .record(LifecycleKind::kTypeChange, 2, 2)
                                .record(LifecycleKind::kSpawn, 3, 1, 70)
                                .end_lifecycle()
                                .bytes());
  ASSERT_TRUE(state) << state.error().message;
  State expected = three_of_four();
  expected.despawn(0);
  expected.set_body(1, {{50, 0, 0}, {6, 0, 0}});
  expected.type()[2] = 2;
  expected.spawn(3, 9, 1, {{70, 0, 0}, {}});
  EXPECT_EQ(*state, expected);
}

TEST(DeltaCodec, ASlotMayBeReusedWithinAFrame) {
  EXPECT_TRUE(decode(
      Payload().record(LifecycleKind::kDespawn, 1).record(LifecycleKind::kSpawn, 1).end_lifecycle().bytes()));
}

TEST(DeltaCodec, RecordsThatBreakTheRulesAreRefused) {
  using K = LifecycleKind;
  EXPECT_FALSE(decode(Payload().record(K::kSpawn, 0).end_lifecycle().bytes())) << "alive";
  EXPECT_FALSE(decode(Payload().record(K::kDespawn, 3).end_lifecycle().bytes())) << "dead";
  EXPECT_FALSE(decode(Payload().record(K::kTeleport, 3).end_lifecycle().bytes())) << "dead";
  EXPECT_FALSE(decode(Payload().record(K::kTypeChange, 3).end_lifecycle().bytes())) << "dead";
  EXPECT_FALSE(decode(Payload().record(K::kDespawn, 4).end_lifecycle().bytes())) << "beyond the capacity";
  EXPECT_FALSE(decode(Payload().record(K::kTypeChange, 0, synthetic::kTypes).end_lifecycle().bytes()))
      << "type";
  EXPECT_FALSE(decode(Payload().record(K::kSpawn, 3, synthetic::kTypes).end_lifecycle().bytes())) << "type";
  EXPECT_FALSE(decode(Payload().record(K::kTeleport, 0, 0, kPositionLimit + 1).end_lifecycle().bytes()))
      << "p";
  EXPECT_FALSE(decode(Payload().record(K::kTeleport, 0, 0, 0, -kVelocityLimit - 1).end_lifecycle().bytes()))
      << "v";
  EXPECT_FALSE(decode(Payload().record(K::kDespawn, 1).record(K::kDespawn, 1).end_lifecycle().bytes()))
      << "twice";
  EXPECT_FALSE(decode(Payload().record(K::kTeleport, 1).record(K::kTypeChange, 1).end_lifecycle().bytes()))
      << "pair";
  EXPECT_FALSE(decode(Payload().section(0x81, {0x80, 0}).bytes())) << "not in shortest form";
  EXPECT_FALSE(decode(Payload().section(0x81, {0xFF, 0xFF, 0xFF, 0x7F}).bytes())) << "beyond any capacity";
  Bytes other_groups = Payload().record(K::kTeleport, 0).end_lifecycle().bytes();
  for (const int mask : {0, 2, 3}) {
    other_groups[3] = static_cast<std::byte>(mask);
    EXPECT_FALSE(decode(other_groups)) << "groups " << mask;
  }
  EXPECT_FALSE(decode(Payload().end_lifecycle().bytes())) << "no record";
}

TEST(DeltaCodec, CorrectionsSeeTheSlotsAfterLifecycle) {
  // Mask of slot 3, which this delta spawns at 70: one position step of 10 on x.
  Payload spawned;
  spawned.record(LifecycleKind::kSpawn, 3, 0, 70).end_lifecycle();
  Bytes payload = spawned.bytes();
  // Block 0, form 1, mask 0b1000.
  const Bytes section = Payload().section(0x83, {0, 1, 0x08, 1, 0, 0, 0, 0, 0}).bytes();
  payload.insert(payload.end(), section.begin(), section.end());
  const auto state = decode(payload);
  ASSERT_TRUE(state) << state.error().message;
  EXPECT_EQ(state->p(0)[3], 80);
  EXPECT_FALSE(decode(section)) << "slot 3 is dead without the spawn";
}

TEST(DeltaCodec, ParametersTravelWithTheDeltaThatUsesThemFirst) {
  DeltaCodec server = make_delta("quantized", 4, kParameters);
  DeltaCodec client = make_delta("quantized", 4, kParameters);
  Bytes out(server.bound());
  State agreed = three_of_four();
  State held = agreed;
  State target = agreed;
  target.p(0)[0] = 1000;
  const StreamParameters changed{{50, 1, 1}};
  server.set_parameters(changed);
  auto encoded = server.encode(agreed, target, {}, kNoBudget, out);
  ASSERT_TRUE(synthetic::receive(client, held, std::span(out).first(encoded.size_bytes)));
  EXPECT_EQ(held, agreed);
  EXPECT_EQ(held.p(0)[0], 127);
  EXPECT_EQ(client.parameters(), changed);
  const std::size_t with_parameters = encoded.size_bytes;
  encoded = server.encode(agreed, target, {}, kNoBudget, out);
  EXPECT_EQ(encoded.size_bytes, with_parameters - 8);  // type, length, three ids with a byte each
  EXPECT_EQ(encoded.correction_bytes, encoded.size_bytes);
}

TEST(DeltaCodec, ParametersOutOfRangeAreRefused) {
  const auto taken = [](const StreamParameters& parameters) {
    return decode(Payload().parameters(parameters).bytes()).has_value();
  };
  const auto body_taken = [](std::initializer_list<int> body) {
    return decode(Payload().section(0x82, body).bytes()).has_value();
  };
  EXPECT_TRUE(taken({{1, 1, 1}}));
  EXPECT_TRUE(taken({{1, 1, 1, 65535, 65535}, {65535}})) << "any decay and gains will do";
  EXPECT_FALSE(taken({{0, 1, 1}}));
  EXPECT_FALSE(taken({{1, -1, 1}}));
  EXPECT_FALSE(taken({{1, 1, kMaxStep + 1}}));
  EXPECT_TRUE(body_taken({1, 2, 4, 0})) << "some";
  EXPECT_TRUE(body_taken({1, 0xC8, 1})) << "100, as before";
  EXPECT_FALSE(body_taken({})) << "none";
  EXPECT_FALSE(body_taken({1})) << "truncated";
  EXPECT_FALSE(body_taken({2, 2, 1, 2})) << "order";
  EXPECT_FALSE(body_taken({1, 2, 1, 2})) << "twice";
  EXPECT_FALSE(body_taken({1, 0x82, 0})) << "not in shortest form";
  EXPECT_FALSE(body_taken({4, 0x80, 0x80, 8})) << "65536";
  EXPECT_FALSE(body_taken({1, 0x80, 0x80, 0x80, 0x80, 0x10})) << "beyond 32 bits";
  EXPECT_FALSE(body_taken({7, 2})) << "unknown";
}

TEST(DeltaCodec, UnknownSectionsAreSkippedUnlessCritical) {
  EXPECT_TRUE(decode(Payload().section(77, {1, 2, 3}).bytes()));
  const auto refused = decode(Payload().section(77 | kCriticalSection, {1, 2, 3}).bytes());
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUnsupported);
}

TEST(DeltaCodec, SectionsOutOfOrderOrRepeatedAreRefused) {
  EXPECT_FALSE(decode(Payload().parameters({{1, 1, 1}}).parameters({{1, 1, 1}}).bytes()));
  EXPECT_FALSE(
      decode(Payload().parameters({{1, 1, 1}}).record(LifecycleKind::kDespawn, 0).end_lifecycle().bytes()));
}

TEST(DeltaCodec, RoundsBeforeTheCorrections) {
  // p of slot 1 is 1 and goes to 0, then by one position step of 10; v by a step of 20, and then to 24.
  const Payload payload = Payload().section(0x87, {2, 3, 0}).section(0x83, {0, 1, 0x02, 1, 0, 0, 1, 0, 0});
  const auto state = decode(payload.bytes());
  ASSERT_TRUE(state) << state.error().message;
  EXPECT_EQ(state->body(1), (BodyState{{10, 0, 0}, {24, 0, 0}}));
  EXPECT_EQ(state->body(2), (BodyState{{4, 0, 0}, {}})) << "2 is half way, and goes up";
}

TEST(DeltaCodec, RoundingStandsBetweenParametersAndCorrectionsOnce) {
  const StreamParameters some{{1, 1, 1}};
  EXPECT_TRUE(decode(Payload().parameters(some).section(0x87, {1, 1, 1}).bytes()));
  EXPECT_FALSE(decode(Payload().section(0x87, {1, 1, 1}).parameters(some).bytes()));
  EXPECT_FALSE(decode(Payload().section(0x87, {1, 1, 1}).section(0x87, {1, 1, 1}).bytes()));
  EXPECT_FALSE(
      decode(Payload().section(0x83, {0, 1, 0x02, 1, 0, 0, 1, 0, 0}).section(0x87, {1, 1, 1}).bytes()));
  EXPECT_FALSE(decode(Payload().section(0x87, {1, 1}).bytes())) << "truncated";
  EXPECT_FALSE(decode(Payload().section(0x87, {25, 1, 1}).bytes())) << "too many bits";
}

TEST(DeltaCodec, RoundingIsAskedForOneFrameAndTouchesAllSlots) {
  DeltaCodec server = make_delta("tracker", 4, kParameters);
  DeltaCodec client = make_delta("tracker", 4, kParameters);
  Bytes out(server.bound());
  State agreed = three_of_four();
  State held = agreed;
  State target = agreed;
  target.set_body(0, {{-1234, 777, 0}, {}});
  server.round_next();
  auto encoded = server.encode(agreed, target, {}, kNoBudget, out);
  ASSERT_TRUE(synthetic::receive(client, held, std::span(out).first(encoded.size_bytes)));
  EXPECT_EQ(held, agreed);
  EXPECT_EQ(encoded.size_bytes - encoded.correction_bytes, 5U);
  EXPECT_EQ(encoded.corrected, 1U);
  for (Slot slot = 0; slot < 3; ++slot) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(agreed.p(i)[slot] % 8, 0) << "corrected bodies too";
      EXPECT_EQ(agreed.v(i)[slot] % 128, 0);
      EXPECT_EQ(agreed.c(i)[slot] % 16, 0);
    }
  }
  EXPECT_EQ(server.touched().size(), 4U);
  EXPECT_EQ(client.touched().size(), 4U);
  EXPECT_EQ(std::vector<Slot>(client.corrected().begin(), client.corrected().end()), std::vector<Slot>{0});
  target = agreed;
  encoded = server.encode(agreed, target, {}, kNoBudget, out);
  EXPECT_EQ(encoded.size_bytes, 0U) << "once only";
}

TEST(DeltaCodec, ABlockMayComeOnlyOnce) {
  DeltaCodec server = make_delta("quantized", 4, kParameters);
  Bytes out(server.bound());
  State state = three_of_four();
  State target = state;
  target.p(0)[0] = 1000;
  const auto encoded = server.encode(state, target, {}, kNoBudget, out);
  Bytes payload(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(encoded.size_bytes));
  EXPECT_TRUE(decode(payload));
  payload.insert(payload.end(), payload.begin(), payload.end());
  EXPECT_FALSE(decode(payload));
}

TEST(DeltaCodec, EveryTruncationAndExtensionOfADeltaIsRefused) {
  for (const std::string_view name : codec_names()) {
    SCOPED_TRACE(name);
    DeltaCodec server = make_delta(name, 4, kParameters);
    Bytes out(server.bound());
    State state = three_of_four();
    State target = state;
    for (Slot slot = 0; slot < 2; ++slot) target.p(0)[slot] = 1000;
    target.despawn(2);
    const std::vector<LifecycleRecord> lifecycle{{LifecycleKind::kDespawn, 2, 0, 0, {}}};
    server.set_parameters({{99, 9, 9}});
    const auto encoded = server.encode(state, target, lifecycle, kNoBudget, out);
    const std::vector<std::size_t> boundaries{0, 3, 3 + 9};  // between sections
    // A code stream without length that was cut short says something else: the state hash tells.
    const std::size_t whole_sections = name == "tracker" ? boundaries.back() + 1 : encoded.size_bytes;
    for (std::size_t size = 0; size < whole_sections; ++size) {
      const bool whole = std::find(boundaries.begin(), boundaries.end(), size) != boundaries.end();
      EXPECT_EQ(decode(Bytes(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size)), name).has_value(),
                whole);
    }
    out.resize(encoded.size_bytes);
    EXPECT_TRUE(decode(out, name));
    out.push_back(std::byte{0});
    EXPECT_FALSE(decode(out, name));
    out.resize(encoded.size_bytes + 8, std::byte{1});
    EXPECT_FALSE(decode(out, name));
  }
}

TEST(DeltaCodec, TouchedNamesEachSlotOfRecordsAndCorrectionsOnce) {
  DeltaCodec server = make_delta("selective", 4, kParameters);
  Bytes out(server.bound());
  State state = three_of_four();
  State target = state;
  target.p(0)[2] = 5000;
  target.p(0)[0] = 7000;
  const LifecycleRecord spawn{LifecycleKind::kSpawn, 1, 1, 1, {{3, 3, 3}, {}}};
  target.spawn(1, 1, 1, spawn.body);
  target.p(0)[1] = 9000;
  const std::vector<LifecycleRecord> lifecycle{{LifecycleKind::kDespawn, 1, 0, 0, {}}, spawn};
  server.encode(state, target, lifecycle, kNoBudget, out);
  EXPECT_EQ(std::vector<Slot>(server.touched().begin(), server.touched().end()),
            (std::vector<Slot>{0, 1, 2}));
  EXPECT_TRUE(std::ranges::equal(server.corrected(), std::vector<Slot>{0, 1, 2}));
  EXPECT_EQ(server.lifecycle().size(), 2U);
  EXPECT_EQ(state, target);
}

TEST(DeltaCodec, AnObserverSeesTheFrameAfterItsRecordsAndBeforeItsCorrections) {
  struct Observer final : EncodeObserver {
    void frame(const State& predicted, const State& target, const CodecParameters& parameters) override {
      EXPECT_EQ(parameters, kParameters.codec);
      before = predicted;
      after = target;
    }
    State before, after;
  };
  DeltaCodec server = make_delta("selective", 4, kParameters);
  Bytes out(server.bound());
  State state = three_of_four();
  State target = state;
  target.p(0)[0] = 5000;
  target.despawn(1);
  State despawned = state;
  despawned.despawn(1);
  Observer observer;
  server.encode(state, target, std::vector<LifecycleRecord>{{LifecycleKind::kDespawn, 1, 0, 0, {}}},
                kNoBudget, out, &observer);
  EXPECT_EQ(observer.before, despawned);
  EXPECT_EQ(observer.after, target);
}

TEST(DeltaCodec, DecodingChangesNothing) {
  for (const std::string_view name : codec_names()) {
    SCOPED_TRACE(name);
    DeltaCodec server = make_delta(name, 4, kParameters);
    DeltaCodec client = make_delta(name, 4, kParameters);
    Bytes out(server.bound());
    State state = three_of_four();
    const State predicted = state;
    State target = state;
    target.p(0)[0] = 5000;
    server.set_parameters({{99, 16, 64}});
    const auto payload = std::span(out).first(server.encode(state, target, {}, kNoBudget, out).size_bytes);
    State held = predicted;
    ASSERT_TRUE(client.decode(held, payload));
    EXPECT_EQ(held, predicted);
    EXPECT_EQ(client.parameters(), kParameters);
    const auto again = client.decode(held, payload);
    ASSERT_TRUE(again);
    client.apply(*again, held);
    EXPECT_EQ(held, state);
    EXPECT_EQ(client.parameters().codec.threshold, 99);
  }
}

}  // namespace
}  // namespace tandem::of_delta
