#include "sdk/core/predict/rigid/solver.hpp"

#include <algorithm>

#include "sdk/core/lattice/fixed_point.hpp"

namespace tandem {
namespace {

using L = RigidLaw;

constexpr std::int32_t kOne = 1 << L::kNormalBits;
constexpr std::int64_t kHalf = kOne / 2;
constexpr int kFirstPasses = 6, kLaterPasses = 4;
constexpr std::int64_t kPushOut = 51;  // of an overlap, in a sub-step, in 2^-8
constexpr std::int64_t kMostPushOut = 1 << 10;

Vec3i arm_of(const RigidBody& body, const Vec3l& at) {
  Vec3i arm{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t x = std::clamp(at[i], -body.most_arm, body.most_arm);
    arm[i] = static_cast<std::int32_t>(x * body.per_length >> (40 + L::kLengthBits - L::kNormalBits));
  }
  return arm;
}

Vec3i cross(const Vec3i& a, const Vec3i& b) {
  Vec3i c{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const std::size_t k = (i + 2) % 3;
    c[i] =
        static_cast<std::int32_t>((std::int64_t{a[j]} * b[k] - std::int64_t{a[k]} * b[j]) >> L::kNormalBits);
  }
  return c;
}

Vec3i times(const Inertia& m, const Vec3i& x, std::int64_t share) {
  const Vec3l y{m[0] * x[0] + m[3] * x[1] + m[5] * x[2], m[3] * x[0] + m[1] * x[1] + m[4] * x[2],
                m[5] * x[0] + m[4] * x[1] + m[2] * x[2]};
  Vec3i of{};
  for (std::size_t i = 0; i < 3; ++i)
    of[i] = static_cast<std::int32_t>((y[i] >> L::kInertiaBits) * share >> L::kNormalBits);
  return of;
}

void change(Vec3i& x, const Vec3i& by, std::int64_t amount) {
  for (std::size_t i = 0; i < 3; ++i)
    x[i] = limited(x[i] + ((by[i] * amount + kHalf) >> L::kNormalBits), L::kMostSpeed);
}

// Applies an impulse along a row.
void apply(const RigidContact& contact, const RigidRow& row, std::int64_t impulse, RigidMotion& a,
           RigidMotion& b) {
  change(a.v, row.d, (impulse * contact.share_a + kHalf) >> L::kNormalBits);
  change(a.spin, row.turn_a, impulse);
  if (contact.share_b == 0) return;
  change(b.v, row.d, -((impulse * contact.share_b + kHalf) >> L::kNormalBits));
  change(b.spin, row.turn_b, -impulse);
}

// The impulse that brings the speed along a row to `wanted`.
std::int64_t needed(const RigidRow& row, std::int64_t wanted, const RigidMotion& a, const RigidMotion& b) {
  return ((wanted - speed_along(row, a, b)) * row.inverse + (1 << 15)) >> 16;
}

std::int32_t gap_now(const RigidContact& contact, const RigidMotion& a, const RigidMotion& b,
                     std::uint32_t substep_bits) {
  const RigidRow& row = contact.rows[0];
  const Vec3l moved{a.moved[0] - b.moved[0], a.moved[1] - b.moved[1], a.moved[2] - b.moved[2]};
  const std::int64_t way =
      product(row.d, moved) + product(row.arm_a, a.turned) - product(row.arm_b, b.turned);
  return limited(contact.gap + (way >> (L::kNormalBits + substep_bits)), L::kMostGap);
}

std::int32_t wanted_at(std::int64_t gap, const RigidMaterial& material) {
  if (gap < 0)
    return static_cast<std::int32_t>(std::min((-gap * kPushOut << material.substep_bits) >> 8, kMostPushOut));
  const std::int64_t beyond = std::int64_t{material.slop} - gap;
  return static_cast<std::int32_t>(
      std::min<std::int64_t>(0, beyond * (std::int64_t{1} << material.substep_bits)));
}

void solve_one(const RigidMaterial& material, RigidContact& contact, RigidMotion& a, RigidMotion& b) {
  const RigidRow& normal = contact.rows[0];
  std::int32_t& push = contact.push[0];
  const auto now = static_cast<std::int32_t>(
      std::clamp<std::int64_t>(push + needed(normal, contact.wanted, a, b), 0, L::kMostImpulse));
  if (now != push) apply(contact, normal, now - push, a, b);
  push = now;
  const std::int64_t most = std::int64_t{push} * material.friction >> 12;
  for (std::size_t k = 1; k < RigidContact::kRows; ++k) {
    const RigidRow& row = contact.rows[k];
    std::int32_t& slide = contact.push[k];
    if (most == 0 && slide == 0) continue;
    const std::int32_t next = limited(slide + needed(row, 0, a, b), most);
    if (next != slide) apply(contact, row, next - slide, a, b);
    slide = next;
  }
}

}  // namespace

std::int64_t speed_along(const RigidRow& row, const RigidMotion& a, const RigidMotion& b) {
  const Vec3i v{a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[2] - b.v[2]};
  return (product(row.d, v) + product(row.arm_a, a.spin) - product(row.arm_b, b.spin)) >> L::kNormalBits;
}

RigidRow normal_row(const RigidBody& a, const RigidBody* b, const Vec3l& at_a, const Vec3l& at_b,
                    const Vec3i& n) {
  RigidRow row;
  row.d = n;
  row.arm_a = cross(arm_of(a, at_a), n);
  if (b != nullptr) row.arm_b = cross(arm_of(*b, at_b), n);
  return row;
}

void set_rows(const RigidBody& a, const RigidBody* b, const Vec3l& at_a, const Vec3l& at_b, const Vec3i& n,
              RigidContact& contact) {
  const std::int64_t of_a = a.mobility;
  const std::int64_t of_b = b == nullptr ? 0 : b->mobility;
  const std::int64_t most = std::max(of_a, of_b);
  contact.share_a = static_cast<std::int32_t>(of_a * kOne / most);
  contact.share_b = static_cast<std::int32_t>(of_b * kOne / most);
  contact.push = {};
  const std::int64_t sign = n[2] < 0 ? -1 : 1;
  const std::int64_t i = (std::int64_t{kOne} << L::kNormalBits) / (kOne + sign * n[2]);
  const std::int64_t x = (n[0] * i + kHalf) >> L::kNormalBits;
  const std::int64_t y = (n[1] * i + kHalf) >> L::kNormalBits;
  const std::int64_t xy = (x * n[1] + kHalf) >> L::kNormalBits;
  const auto narrow = [](std::int64_t value) { return static_cast<std::int32_t>(value); };
  contact.rows[0].d = n;
  contact.rows[1].d = {narrow(kOne - ((n[0] * x + kHalf) >> L::kNormalBits)), narrow(-sign * xy), -n[0]};
  contact.rows[2].d = {narrow(-xy), narrow(sign * (kOne - ((n[1] * y + kHalf) >> L::kNormalBits))),
                       narrow(-sign * n[1])};
  const Vec3i arm_a = arm_of(a, at_a);
  const Vec3i arm_b = b == nullptr ? Vec3i{} : arm_of(*b, at_b);
  for (RigidRow& row : contact.rows) {
    row.arm_a = cross(arm_a, row.d);
    row.turn_a = times(a.inertia, row.arm_a, contact.share_a);
    row.arm_b = cross(arm_b, row.d);
    row.turn_b = b == nullptr ? Vec3i{} : times(b->inertia, row.arm_b, contact.share_b);
    const std::int64_t turns =
        (product(row.arm_a, row.turn_a) + product(row.arm_b, row.turn_b)) >> L::kNormalBits;
    row.inverse = static_cast<std::int32_t>((std::int64_t{1} << (L::kNormalBits + 16)) /
                                            (contact.share_a + contact.share_b + turns));
  }
}

void solve(const RigidMaterial& material, std::span<RigidContact> contacts, std::span<RigidMotion> motions) {
  const std::int64_t substeps = std::int64_t{1} << material.substep_bits;
  const auto bodies = motions.first(motions.size() - 1);
  for (std::int64_t k = 1; k <= substeps; ++k) {
    for (RigidMotion& body : bodies) {
      for (std::size_t i = 0; i < 3; ++i) {
        const std::int64_t fall = body.fall[i];
        const std::int64_t part =
            (k * fall >> material.substep_bits) - ((k - 1) * fall >> material.substep_bits);
        body.v[i] = limited(body.v[i] + part, L::kMostSpeed);
      }
    }
    if (k > 1) {
      for (const RigidContact& contact : contacts) {
        for (std::size_t row = 0; row < RigidContact::kRows; ++row)
          if (contact.push[row] != 0)
            apply(contact, contact.rows[row], contact.push[row], motions[contact.a], motions[contact.b]);
      }
    }
    for (RigidContact& contact : contacts)
      contact.wanted = wanted_at(
          gap_now(contact, motions[contact.a], motions[contact.b], material.substep_bits), material);
    for (int pass = 0; pass < (k == 1 ? kFirstPasses : kLaterPasses); ++pass) {
      for (RigidContact& contact : contacts)
        solve_one(material, contact, motions[contact.a], motions[contact.b]);
    }
    for (RigidMotion& body : bodies) {
      for (std::size_t i = 0; i < 3; ++i) {
        body.moved[i] += body.v[i];
        body.turned[i] += body.spin[i];
      }
    }
  }
  for (const RigidContact& contact : contacts) {
    RigidMotion& a = motions[contact.a];
    RigidMotion& b = motions[contact.b];
    const std::int64_t push = contact.push[0];
    const std::int64_t wanted = std::min(contact.wanted, 0);
    const std::int64_t now =
        std::clamp<std::int64_t>(push + needed(contact.rows[0], wanted, a, b), 0, L::kMostImpulse);
    if (now != push) apply(contact, contact.rows[0], now - push, a, b);
  }
}

}  // namespace tandem
