#include "tandem/eigen.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tandem {
namespace {

TEST(EigenViews, ASampleIsAMatrixWithAColumnASlot) {
  Sample sample;
  sample.capacity = 3;
  sample.positions = {1, 2, 3, 40, 50, 60, 5, 6, 7};
  sample.alive = {1, 0, 1};
  EXPECT_EQ(positions(sample).col(2), Eigen::Vector3f(5, 6, 7));
  const Eigen::RowVectorXf weights = alive(sample).cast<float>().transpose();
  const Eigen::Vector3f mean = positions(sample) * weights.transpose() / weights.sum();
  EXPECT_EQ(mean, Eigen::Vector3f(3, 4, 5));
  EXPECT_EQ(positions(sample).data(), sample.positions.data()) << "a view, not a copy";
}

TEST(EigenViews, OrientationsAreQuaternionsInEigensOrder) {
  Sample sample;
  sample.capacity = 2;
  sample.positions.resize(6);
  sample.orientations = {0, 0, 0, 1, 0, 0, std::sqrt(0.5F), std::sqrt(0.5F)};
  ASSERT_TRUE(has_orientations(sample));
  EXPECT_EQ(orientations(sample).cols(), 2);
  EXPECT_EQ(orientations(sample).col(0), Eigen::Vector4f(0, 0, 0, 1));
  const Eigen::Vector3f turned = orientation(sample, 1) * Eigen::Vector3f::UnitX();
  EXPECT_TRUE(turned.isApprox(Eigen::Vector3f::UnitY())) << "a quarter turn about z, body to world";
  EXPECT_EQ(orientation(sample, 1).coeffs().data(), sample.orientations.data() + 4) << "a view, not a copy";
}

TEST(EigenViews, WithoutOrientationsThereIsNoColumn) {
  EXPECT_FALSE(has_orientations(Sample{}));
  EXPECT_EQ(orientations(Sample{}).cols(), 0);
}

TEST(EigenViews, AnEmptySampleIsAnEmptyMatrix) { EXPECT_EQ(positions(Sample{}).cols(), 0); }

}  // namespace
}  // namespace tandem
