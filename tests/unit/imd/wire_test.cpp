#include "services/adapters/imd/wire.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <random>

namespace tandem::imd {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using Bytes = std::vector<std::byte>;

constexpr Session kVersion2{.version = 2, .coordinates = true};
constexpr Session kVersion3{.version = 3,
                            .time = true,
                            .energies = true,
                            .box = true,
                            .coordinates = true,
                            .velocities = true,
                            .forces = true};

Bytes numbers(std::initializer_list<std::uint32_t> words) {
  Bytes out;
  for (const std::uint32_t word : words)
    for (int shift = 24; shift >= 0; shift -= 8)
      out.push_back(static_cast<std::byte>(word >> static_cast<unsigned>(shift)));
  return out;
}

// What an engine sends, in this machine's byte order.
void append(Bytes& out, const void* bytes, std::size_t count) {
  out.resize(out.size() + count);
  std::memcpy(out.data() + out.size() - count, bytes, count);
}

void append_session(Bytes& out, const Session& session) {
  append_head(out, Type::kHandshake, 0);
  const std::int32_t version = session.version;
  std::memcpy(out.data() + out.size() - 4, &version, 4);  // in this machine's order, which tells it
  if (version < 3) return;
  append_head(out, Type::kSessionInfo, 7);
  for (const bool flag : {session.time, session.energies, session.box, session.coordinates, session.wrapped,
                          session.velocities, session.forces})
    out.push_back(flag ? std::byte{1} : std::byte{0});
}

void append_moment(Bytes& out, const Moment& moment) {
  append_head(out, Type::kTime, 1);
  append(out, &moment.dt, 8);
  append(out, &moment.time, 8);
  append(out, &moment.step, 8);
}

void append_box(Bytes& out, const std::array<float, 9>& box) {
  append_head(out, Type::kBox, 1);
  append(out, box.data(), sizeof box);
}

void append_vectors(Bytes& out, Type type, std::span<const float> values) {
  append_head(out, type, static_cast<std::int32_t>(values.size() / 3));
  append(out, values.data(), values.size_bytes());
}

void append_energies(Bytes& out) {
  append_head(out, Type::kEnergies, 1);
  out.resize(out.size() + 40);
}

Bytes frame3(float first, std::int64_t step) {
  Bytes out;
  append_moment(out, {.dt = 0.5, .time = 0.5 * static_cast<double>(step), .step = step});
  append_energies(out);
  append_box(out, {10, 0, 0, 0, 11, 0, 0, 0, 12});
  append_vectors(out, Type::kCoordinates, std::vector<float>{first, 2, 3, 4, 5, 6});
  append_vectors(out, Type::kVelocities, std::vector<float>{-1, -2, -3, -4, -5, -6});
  append_vectors(out, Type::kForces, std::vector<float>{0, 0, 0, 0, 0, 0});
  return out;
}

Bytes session_bytes(const Session& session) {
  Bytes out;
  append_session(out, session);
  return out;
}

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

struct Read {
  std::vector<Frame> frames;
  std::optional<Session> session;
  std::string error;
};

Read read(const Bytes& bytes, std::uint32_t atoms = 2, std::size_t piece = SIZE_MAX) {
  Read result;
  EngineReader reader(atoms);
  for (std::size_t at = 0; at < bytes.size() && result.error.empty();
       at += std::min(piece, bytes.size() - at)) {
    const auto good = reader.take(
        std::span(bytes).subspan(at, std::min(piece, bytes.size() - at)),
        [&result](const Session& session) { result.session = session; },
        [&result](Frame& frame) { result.frames.push_back(frame); });
    if (!good) result.error = good.error().message;
  }
  return result;
}

TEST(ImdWire, BytesOfTheProtocolsText) {
  Bytes out;
  append_head(out, Type::kGo, 0);
  append_head(out, Type::kRate, 258);
  EXPECT_EQ(out, numbers({3, 0, 8, 258}));
  const Bytes hello = session_bytes({.version = 3, .time = true, .coordinates = true, .velocities = true});
  EXPECT_EQ(Bytes(hello.begin(), hello.begin() + 4), numbers({4}));
  std::int32_t version = 0;
  std::memcpy(&version, hello.data() + 4, 4);
  EXPECT_EQ(version, 3);
  EXPECT_EQ(Bytes(hello.begin() + 8, hello.begin() + 16), numbers({10, 7}));
  const std::array<int, 7> flags{1, 0, 0, 1, 0, 1, 0};
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(std::to_integer<int>(hello[16 + i]), flags[i]);
  EXPECT_EQ(hello.size(), 23U);
  const Bytes whole = frame3(1, 7);
  EXPECT_EQ(whole.size(), 6 * 8U + 24 + 40 + 36 + 3 * 24);
  EXPECT_EQ(Bytes(whole.begin(), whole.begin() + 8), numbers({12, 1}));
}

TEST(ImdWire, FramesOfVersion3ComeInAnyPieces) {
  const Bytes bytes = session_bytes(kVersion3) + frame3(1, 7) + frame3(1.5F, 9);
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{64}, bytes.size()}) {
    const Read got = read(bytes, 2, piece);
    EXPECT_EQ(got.error, "");
    ASSERT_TRUE(got.session);
    EXPECT_EQ(got.session->version, 3);
    ASSERT_EQ(got.frames.size(), 2U);
    EXPECT_THAT(got.frames[1].positions, ElementsAre(1.5F, 2, 3, 4, 5, 6));
    EXPECT_THAT(got.frames[1].velocities, ElementsAre(-1, -2, -3, -4, -5, -6));
    EXPECT_EQ(got.frames[1].number, 2U);
    EXPECT_EQ(got.frames[1].moment->step, 9);
    EXPECT_EQ(got.frames[1].moment->time, 4.5);
    EXPECT_EQ((*got.frames[1].box)[4], 11);
  }
}

TEST(ImdWire, Version2HasCoordinatesAndPerhapsEnergies) {
  Bytes bytes = session_bytes(kVersion2);
  append_energies(bytes);
  append_vectors(bytes, Type::kCoordinates, std::vector<float>(6, 1));
  append_vectors(bytes, Type::kCoordinates, std::vector<float>(6, 2));
  const Read got = read(bytes);
  EXPECT_EQ(got.error, "");
  EXPECT_EQ(got.frames.size(), 2U);
  EXPECT_TRUE(got.frames.back().velocities.empty());
}

TEST(ImdWire, TheOtherByteOrderIsTurned) {
  Bytes bytes = numbers({4, 2});  // this machine is of the other order
  append_head(bytes, Type::kCoordinates, 2);
  for (const float value : {1.0F, 2.0F, 3.0F, 4.0F, 5.0F, -6.5F}) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, 4);
    bytes = bytes + numbers({bits});
  }
  const Read got = read(bytes);
  EXPECT_TRUE(got.session->swapped);
  ASSERT_EQ(got.frames.size(), 1U);
  EXPECT_THAT(got.frames[0].positions, ElementsAre(1, 2, 3, 4, 5, -6.5F));
  Bytes forces;
  append_forces(forces, std::vector<std::int32_t>{1}, std::vector<float>{1, 0, 0}, true);
  EXPECT_EQ(forces, numbers({6, 1, 1, 0x3F800000, 0, 0}));
}

TEST(ImdWire, LiesAreRefusedInALine) {
  const Bytes two = session_bytes(kVersion2), three = session_bytes(kVersion3);
  Bytes other = three;
  const auto refused = [](const Bytes& bytes, const char* line) {
    EXPECT_THAT(read(bytes).error, HasSubstr(line));
    EXPECT_THAT(read(bytes, 2, 1).error, HasSubstr(line));
  };
  refused(numbers({0x48545450, 0x2F312E31}), "no IMD engine");
  refused(numbers({4, 1}), "version 1");
  refused(numbers({4, 77}), "version 77");
  refused(two + numbers({2, 3}), "sends 3 atoms, but the topology has 2");
  refused(two + numbers({2, 0xFFFFFFFF}), "sends -1 atoms");
  refused(two + numbers({1, 2}), "count of 2, not 1");
  refused(two + numbers({77, 0}), "type 77");
  refused(two + numbers({3, 0}), "type 3, which no engine sends");
  refused(two + numbers({10, 7}), "session info in the middle");
  refused(two + numbers({12, 1}) + Bytes(24), "which the engine's session does not have");
  refused(two + numbers({0, 0}), "ended the connection after 0 frames");
  refused(Bytes(three.begin(), three.begin() + 8) + numbers({2, 2}), "where version 3 has its session info");
  refused(Bytes(three.begin(), three.begin() + 8) + numbers({10, 8}), "count of 8, not 7");
  refused(session_bytes({.version = 3, .time = true}), "no coordinates");
  refused(three + numbers({13, 1}) + Bytes(36) + numbers({12, 1}) + Bytes(24), "out of its order");
  refused(three + numbers({12, 1}) + Bytes(24) + numbers({14, 2}) + Bytes(24), "without coordinates");
}

TEST(ImdWire, GarbageIsRefusedOrRead) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  const Bytes good = session_bytes(kVersion3) + frame3(1, 7) + frame3(2, 8);
  for (int i = 0; i < 3000; ++i) {
    Bytes bytes = good;
    for (auto n = 1 + random() % 4; n > 0; --n)
      bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    const Read got = read(bytes, 2, 1 + random() % 50);
    EXPECT_LE(got.frames.size(), 2U);
    for (const Frame& frame : got.frames) EXPECT_EQ(frame.positions.size(), 6U);
    EXPECT_LT(got.error.size(), 200U);
  }
}

}  // namespace
}  // namespace tandem::imd
