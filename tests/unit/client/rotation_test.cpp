#include "sdk/client/drawing/rotation.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tandem::client {
namespace {

constexpr double kRadian = 1 << 28;

Rotation turned_about_z(double angle) {
  return {0, 0, static_cast<float>(std::sin(angle / 2)), static_cast<float>(std::cos(angle / 2))};
}
Rotation negated(const Rotation& q) { return {-q[0], -q[1], -q[2], -q[3]}; }

/// The angle from one to the other, rad.
double apart(const Rotation& a, const Rotation& b) {
  double plus = 0, minus = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    plus += std::pow(double{a[i]} - double{b[i]}, 2);
    minus += std::pow(double{a[i]} + double{b[i]}, 2);
  }
  return 4 * std::asin(std::sqrt(std::min(plus, minus)) / 2);
}
double norm(const Rotation& q) {
  double sum = 0;
  for (const float x : q) sum += double{x} * double{x};
  return std::sqrt(sum);
}

TEST(Rotation, GoesAtAConstantRateFromOneToTheOther) {
  for (const double angle : {1e-4, 0.05, 0.0999, 0.1, 0.101, 0.5, 1.0, 2.0, 3.1}) {
    for (int eighth = 0; eighth <= 8; ++eighth) {
      const double share = eighth / 8.0;
      const Rotation q = between(turned_about_z(0.3), turned_about_z(0.3 + angle), static_cast<float>(share));
      EXPECT_LT(apart(q, turned_about_z(0.3 + angle * share)), 5e-6) << angle << " rad, share " << share;
      EXPECT_NEAR(norm(q), 1, 3e-7);
    }
  }
}

TEST(Rotation, TakesTheShorterWayWhicheverSignIsGiven) {
  const Rotation a = turned_about_z(0.2), b = turned_about_z(1.4);
  for (const Rotation& to : {b, negated(b)}) {
    for (const Rotation& from : {a, negated(a)})
      EXPECT_LT(apart(between(from, to, 0.5F), turned_about_z(0.8)), 2e-6);
  }
  EXPECT_LT(apart(between(turned_about_z(-3), turned_about_z(3), 0.5F), turned_about_z(3.14159265)), 5e-6);
}

TEST(Rotation, BetweenOneAndItselfThereIsOnlyIt) {
  const Rotation q = turned_about_z(2);
  EXPECT_LT(apart(between(q, q, 0.3F), q), 1e-6);
  EXPECT_LT(apart(between(q, negated(q), 0.3F), q), 1e-6);
}

TEST(Rotation, HalfATurnApartStillGivesARotation) {
  EXPECT_NEAR(norm(between({1, 0, 0, 0}, {0, 1, 0, 0}, 0.5F)), 1, 1e-6);
}

TEST(Rotation, TurnsOnAsTheLatticeDoes) {
  Quaternion exact{1 << 29, 1 << 29, -(1 << 29), 1 << 29};
  const Spin spin{static_cast<std::int32_t>(0.3 * kRadian), static_cast<std::int32_t>(-1.2 * kRadian),
                  static_cast<std::int32_t>(0.7 * kRadian)};
  Rotation drawn = to_rotation(exact);
  for (int frame = 0; frame < 20; ++frame) {
    exact = turned(exact, spin);
    drawn = turned_on(drawn, spin, 1);
    EXPECT_LT(apart(drawn, to_rotation(exact)), 2e-5) << "frame " << frame;
  }
  EXPECT_NEAR(norm(drawn), 1, 3e-7);
}

TEST(Rotation, TurnsBackAndByPartsOfAFrame) {
  const Rotation q = turned_about_z(0.4);
  const Spin spin{0, 0, static_cast<std::int32_t>(1.5 * kRadian)};
  EXPECT_LT(apart(turned_on(q, spin, -0.5F), turned_about_z(0.4 - 0.75)), 2e-6);
  EXPECT_LT(apart(turned_on(q, spin, 0), q), 1e-6);
  EXPECT_LT(apart(turned_on(q, {}, 1), q), 1e-6);
  const Spin fastest{0, 0, kSpinLimit};
  for (const float frames : {-2.0F, -1.3F, 1.7F, 2.0F})
    EXPECT_LT(apart(turned_on(q, fastest, frames), turned_about_z(0.4 + 2 * double{frames})), 2e-6) << frames;
  EXPECT_LT(apart(turned_on(q, {0, 0, 1}, 1), q), 1e-6);
}

}  // namespace
}  // namespace tandem::client
