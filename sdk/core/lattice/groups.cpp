#include "sdk/core/lattice/groups.hpp"

#include <algorithm>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/lattice/slot_runs.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {
namespace {

static_assert([] {
  std::size_t columns = 0;
  for (const ChannelGroup& each : kChannelGroups) {
    if (each.first_column != columns) return false;
    for (const ColumnRun& run : each.runs) columns += run.columns;
  }
  return columns == kColumns;
}());

// Calls visit() for each vector that a lifecycle record of a body with these groups (bits) holds, in the
// record's order; with several bodies, for the same vector of all at once.
template <class Visit, class... Bodies>
constexpr void for_each_vector(unsigned groups, const Visit& visit, Bodies&... bodies) {
  if ((groups & kMovesPosition) != 0) {
    visit(bodies.p...);
    visit(bodies.v...);
  }
  if ((groups & kMovesOrientation) != 0) {
    visit(bodies.q...);
    visit(bodies.w...);
  }
}

// A group without a vector would travel in no record.
static_assert([] {
  BodyState body;
  for (const ChannelGroup& each : kChannelGroups) {
    bool has_vectors = false;
    for_each_vector(
        each.bit, [&has_vectors](const auto&) { has_vectors = true; }, body);
    if (!has_vectors) return false;
  }
  return true;
}());

bool within(const Vec3i& values, std::int32_t limit) {
  return std::all_of(values.begin(), values.end(),
                     [limit](std::int32_t x) { return -limit <= x && x <= limit; });
}

}  // namespace

bool valid_body(const BodyState& body) {
  return within(body.p, kPositionLimit) && within(body.v, kVelocityLimit) && valid_quaternion(body.q) &&
         valid_spin(body.w);
}

std::uint64_t surface_error(const BodyState& body, const BodyState& target, std::int32_t radius) {
  const std::uint64_t squared = distance_squared(body.p, target.p);
  const std::uint64_t apart = squared == 0 ? 0 : square_root(squared - 1) + 1;
  if (body.q == target.q) return apart;
  const std::uint64_t turned =
      std::uint64_t{2} * static_cast<std::uint32_t>(radius) * half_sine(body.q, target.q);
  return apart + (turned >> 30U) + 1;
}

void step_groups(const State& from, State& to) { step_groups(from, to, 0, to.capacity()); }

void step_groups(const State& from, State& to, std::span<const Slot> slots) {
  if (!to.groups().orientation) return;
  for (const Slot slot : slots) {
    const Spin w{from.w(0)[slot], from.w(1)[slot], from.w(2)[slot]};
    const Quaternion q = from.quaternion(slot);
    to.set_quaternion(slot, to.rest()[slot] != 0 ? q : turned(q, w));
    for (std::size_t i = 0; i < kSpinChannels; ++i) to.w(i)[slot] = w[i];
  }
}

std::uint8_t bits_of(const Groups& groups) {
  unsigned bits = 0;
  for_each_group(groups, [&bits](const ChannelGroup& each) { bits |= each.bit; });
  return static_cast<std::uint8_t>(bits);
}

void put_body(unsigned groups, const BodyState& body, ByteWriter& out) {
  ByteWriter copy = out;  // which stays in registers
  const auto put = [&copy](const auto& vector) {
    for (const std::int32_t number : vector) copy.put(number);
  };
  for_each_vector(groups, put, body);
  out = copy;
}

void get_body(unsigned groups, ByteReader& in, BodyState& body) {
  ByteReader copy = in;
  const auto get = [&copy](auto& vector) {
    for (std::int32_t& number : vector) number = copy.get<std::int32_t>();
  };
  for_each_vector(groups, get, body);
  in = copy;
}

std::size_t body_bytes(unsigned groups) {
  std::size_t bytes = 0;
  const BodyState body;
  for_each_vector(
      groups, [&bytes](const auto& vector) { bytes += sizeof vector; }, body);
  return bytes;
}

void move_body(unsigned groups, const BodyState& from, BodyState& to) {
  for_each_vector(
      groups, [](const auto& a, auto& b) { b = a; }, from, to);
}

}  // namespace tandem
